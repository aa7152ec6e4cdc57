#include "waymark/app/live/robot_frames.hpp"

#include <chrono>
#include <utility>

#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/robots/dds/ros_names.hpp"

namespace waymark {
namespace {

constexpr Duration kPatience = std::chrono::seconds(3);

/// What messages with pictures, calibration or tags begin with.
struct Headed {
  ros2::Header header{};
  WAYMARK_ROS2_FIELDS(self.header)
};

struct HeadedOdometry {
  ros2::Header header{};
  std::string child_frame_id{};
  WAYMARK_ROS2_FIELDS(self.header, self.child_frame_id)
};

/// The topic that says the frame of the camera, the lightest first.
std::pair<std::string, std::string_view> topic_of_camera(const Ros2Profile& profile) {
  if (!profile.camera_info_topic.empty()) return {profile.camera_info_topic, ros2::CameraInfo::kType};
  if (!profile.detections_topic.empty())
    return {profile.detections_topic, ros2::AprilTagDetectionArray::kType};
  if (!profile.compressed_image_topic.empty())
    return {profile.compressed_image_topic, ros2::CompressedImage::kType};
  return {profile.image_topic, ros2::Image::kType};
}

}  // namespace

RobotFrames::RobotFrames(NodeRobot robot) : robot_(std::move(robot)) {
  odom_ = robot_.profile ? frame_name(robot_.profile->odom_frame) : "";
  base_ = robot_.profile ? frame_name(robot_.profile->base_frame) : "";
}

Status RobotFrames::listen(Bus& bus, const std::string& topic, std::string_view type, const TopicQos& qos,
                           std::optional<std::size_t>& number) {
  const auto made = bus.subscribe(dds_topic(topic, type), qos);
  if (!made) return tl::unexpected(made.error());
  number = *made;
  return {};
}

Status RobotFrames::join(Bus& bus) {
  constexpr TopicQos kNewest{.reliable = false, .depth = 1};
  constexpr int kLinks = 100;
  Status status =
      listen(bus, "/tf_static", ros2::TFMessage::kType, {.transient_local = true, .depth = kLinks}, fixed_);
  if (status)
    status = listen(bus, "/tf", ros2::TFMessage::kType, {.reliable = false, .depth = kLinks}, moving_);
  if (robot_.profile && status)
    status = listen(bus, robot_.profile->odometry_topic, ros2::Odometry::kType, kNewest, odometry_);
  if (!robot_.profile || !robot_.own_pictures || !status) return status;
  const auto [topic, type] = topic_of_camera(*robot_.profile);
  return topic.empty() ? status : listen(bus, topic, type, kNewest, pictures_);
}

bool RobotFrames::take(Bus& bus, const BusMessage& message) {
  const auto is = [&](const std::optional<std::size_t>& number) { return number == message.subscription; };
  if (is(fixed_) || is(moving_)) {
    hear_transforms(message);
  } else if (is(odometry_)) {
    hear_odometry(message);
    end(bus, odometry_);
  } else if (is(pictures_)) {
    hear_camera(message);
    end(bus, pictures_);
  } else {
    return false;
  }
  return true;
}

void RobotFrames::hear_odometry(const BusMessage& message) {
  const auto said = cdr::decode<HeadedOdometry>(message.bytes);
  if (!said) return;
  if (odom_.empty()) odom_ = frame_name(said->header.frame_id);
  if (base_.empty()) base_ = frame_name(said->child_frame_id);
}

void RobotFrames::hear_camera(const BusMessage& message) {
  if (const auto said = cdr::decode<Headed>(message.bytes)) camera_ = frame_name(said->header.frame_id);
}

void RobotFrames::hear_transforms(const BusMessage& message) {
  const auto said = cdr::decode<ros2::TFMessage>(message.bytes);
  if (!said) return;
  for (const ros2::TransformStamped& link : said->transforms)
    tree_.add(link.header.frame_id, link.child_frame_id, std::nullopt);  // only who hangs below whom
}

void RobotFrames::end(Bus& bus, std::optional<std::size_t>& number) {
  if (number) bus.unsubscribe(*number);
  number.reset();
}

void RobotFrames::robot_speaks(Duration now) {
  if (!since_) since_ = now;
}

bool RobotFrames::settled(Duration now) const {
  return (!odometry_ && !pictures_) || (since_ && now - *since_ >= kPatience);
}

std::string RobotFrames::odom() const { return odom_.empty() ? std::string(ros2::kOdomFrame) : odom_; }
std::string RobotFrames::base() const { return base_.empty() ? std::string(ros2::kBaseFrame) : base_; }

std::string RobotFrames::camera(std::string_view name) const {
  const bool own = robot_.profile && robot_.own_pictures && name == "cam";
  return own && !camera_.empty() ? camera_ : ros2::camera_frame(name);
}

std::optional<ros2::TFMessage> RobotFrames::mount(Bus& bus, const std::string& camera, Duration now) {
  if (!since_ || now - *since_ < kPatience || !looked_at_.insert(camera).second) return std::nullopt;
  end(bus, moving_);
  const MountedCamera* mounted = find_camera(robot_.cameras, camera);
  const std::string frame = this->camera(camera);
  if (mounted == nullptr || tree_.joined(base(), frame)) return std::nullopt;
  mountings_.transforms.push_back(ros2::to_ros_transform({}, base(), frame, mounted->base_T_cam));
  return mountings_;
}

}  // namespace waymark
