#include "waymark/app/robot/ros2_robot_sim.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/robot/plant.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/ros2/other_publishers.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr const char* kOpticalFrame = "camera_color_optical_frame";
constexpr TopicQos kSensors{.reliable = true, .depth = 10};
constexpr TopicQos kImages{.reliable = true, .depth = 5, .large = true};
constexpr TopicQos kFixed{.reliable = true, .transient_local = true, .depth = 1};

class Ros2RobotSim {
 public:
  Ros2RobotSim(Bus& bus, Plant& plant, const SimulatedSetup& setup)
      : bus_(bus), plant_(plant), model_(setup.model), camera_(setup.camera), lidar_(setup.robot.lidar) {}

  Status run(const JobControl& control) {
    const auto& should_stop = control.cancelled;
    if (Status alone = check_no_other_simulation(should_stop); !alone) return alone;
    const auto commands = bus_.subscribe(dds_topic("/cmd_vel", ros2::Twist::kType), {.depth = 1});
    if (!commands) return tl::unexpected(commands.error());
    const auto now =
        std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch());
    switched_on_ = now - plant_.uptime();
    PlantPace pace(steady_now, plant_.uptime(), control.note);
    control.note("publishing /odom and the sensors of " + model_.name +
                 " on ROS 2, obeying /cmd_vel, until Ctrl-C");
    Status status = publish("/tf_static", mountings(SensorTime(now)), kFixed);
    const Duration look_again =
        steady_now() + std::chrono::seconds(2);  // detects a robot that is started at the same time
    bool looked = false;
    while (status && !should_stop()) {
      if (!looked && steady_now() > look_again) {
        looked = true;
        if (Status alone = look_for_another(); !alone) return alone;
      }
      auto sample = plant_.next();
      status = sample ? speak(std::move(*sample), pace.left_out()) : tl::unexpected(sample.error());
      pace.leave_out(plant_.uptime());
      do {  // loop until the next sample is due, but at least until all waiting messages are read
        const auto message = bus_.next(pace.ahead(plant_.uptime()));
        if (message) obey(message->bytes);
      } while (pace.ahead(plant_.uptime()) > Duration(0) && !should_stop());
    }
    return should_stop() ? Status() : status;
  }

 private:
  /// The transforms of all sensors; the axes of the IMU are those of the base.
  [[nodiscard]] ros2::TFMessage mountings(SensorTime now) const {
    ros2::TFMessage message{
        {ros2::to_ros_transform(now, ros2::kBaseFrame, kOpticalFrame, model_.base_T_cam)}};
    const SE3 base_T_lidar(SO3::from_rpy(0, 0, to_radians(lidar_.yaw_deg)),
                           {lidar_.x_m, lidar_.y_m, lidar_.z_m});
    if (lidar_.rate_hz > 0)
      message.transforms.push_back(
          ros2::to_ros_transform(now, ros2::kBaseFrame, ros2::kLaserFrame, base_T_lidar));
    return message;
  }

  /// Run this check before publishing, for as long as discovery takes, because two robots on the same topics
  /// would look like a single robot that jumps.
  Status check_no_other_simulation(const std::function<bool()>& should_stop) {
    constexpr Duration kDiscovery = std::chrono::milliseconds(1500);
    constexpr Duration kLookFor = std::chrono::milliseconds(50);
    const Duration until = steady_now() + kDiscovery;
    while (steady_now() < until && !should_stop()) {
      if (Status alone = look_for_another(); !alone) return alone;
      (void)bus_.next(kLookFor);
    }
    return {};
  }

  [[nodiscard]] Status look_for_another() const {
    if (publishers_of(dds_topic("/odom", ros2::Odometry::kType), bus_).empty()) return {};
    return fail(ErrorCode::InvalidArgument,
                fmt::format("another program already publishes this topic; nodes: {}",
                            fmt::join(bus_.participants(), ", ")),
                {.source = "/odom"},
                "End that robot or simulation, or use another ROS_DOMAIN_ID for this robot and its driver.");
  }

  /// Ignores commands with non-finite values.
  void obey(std::span<const std::uint8_t> bytes) {
    const auto twist = cdr::decode<ros2::Twist>(bytes);
    if (!twist || !std::isfinite(twist->linear.x) || !std::isfinite(twist->angular.z)) return;
    (void)plant_.command({twist->linear.x, twist->angular.z});
  }

  template <class Message>
  Status publish(const std::string& topic, const Message& message, const TopicQos& qos = kSensors) {
    auto known = publishers_.find(topic);
    if (known == publishers_.end()) {
      const auto made = bus_.advertise(dds_topic(topic, Message::kType), qos);
      if (!made) return tl::unexpected(made.error());
      known = publishers_.emplace(topic, *made).first;
    }
    return bus_.publish(known->second, cdr::encode(message));
  }

  Status speak(Sample sample, Duration left_out) {
    std::visit([&](auto& value) { value.stamp += switched_on_ + left_out; }, sample);
    return std::visit([this](const auto& value) { return publish_item(value); }, sample);
  }

  Status publish_item(const Odometry& odometry) {
    const auto tf = ros2::to_ros_transform(odometry.stamp, ros2::kOdomFrame, ros2::kBaseFrame,
                                           lift(odometry.odom_T_base));
    Status status = publish("/odom", ros2::to_ros(odometry));
    return status ? publish("/tf", ros2::TFMessage{{tf}}) : status;
  }
  Status publish_item(const ImuSample& imu) { return publish("/imu", ros2::to_ros(imu)); }
  Status publish_item(const WheelTicks& wheels) { return publish("/joint_states", ros2::to_ros(wheels)); }
  Status publish_item(const LaserScan& scan) { return publish("/scan", ros2::to_ros(scan)); }
  Status publish_item(const TruthPose& truth) { return publish("/truth/pose", ros2::to_ros(truth)); }
  Status publish_item(const TagFrame& frame) {
    Status status = publish_camera_info(frame.stamp);
    ros2::AprilTagDetectionArray message = ros2::to_ros(frame);
    message.header.frame_id = kOpticalFrame;
    return status ? publish("/tag_detections", message) : status;
  }
  Status publish_item(const CameraFrame& frame) {
    ros2::Image message = ros2::to_ros(frame);
    message.header.frame_id = kOpticalFrame;
    Status status = publish_camera_info(frame.stamp);
    return status ? publish("/camera/color/image_raw", message, kImages) : status;
  }
  template <class Other>
  Status publish_item(const Other& /*has no topic*/) {
    return {};
  }
  Status publish_camera_info(SensorTime stamp) {
    ros2::CameraInfo message = ros2::to_ros(camera_, stamp);
    message.header.frame_id = kOpticalFrame;
    return publish("/camera/color/camera_info", message);
  }

  Bus& bus_;
  Plant& plant_;
  RobotModel model_;
  CameraModel camera_;
  LidarOptions lidar_;
  Duration switched_on_{};  ///< time on the clock of this machine
  std::map<std::string, std::size_t> publishers_{};
};

}  // namespace

Status run_ros2_robot_sim(Bus& bus, Plant& plant, const SimulatedSetup& setup, const JobControl& control) {
  return Ros2RobotSim(bus, plant, setup).run(control);
}

}  // namespace waymark
