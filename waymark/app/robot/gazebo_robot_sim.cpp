#include "waymark/app/robot/gazebo_robot_sim.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/robot/plant.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

class GazeboRobotSim {
 public:
  GazeboRobotSim(GazeboLink& link, const GazeboProfile& profile, Plant& plant, const CameraModel& camera)
      : link_(link), profile_(profile), plant_(plant), camera_(camera) {}

  Status run(const JobControl& control) {
    const auto& should_stop = control.cancelled;
    if (Status alone = check_no_other_simulation(); !alone) return alone;
    constexpr int kNewest = 1;
    if (const auto orders = link_.subscribe(profile_.command_topic, kNewest); !orders)
      return tl::unexpected(orders.error());
    Status status;
    for (const GazeboSubscription& one : subscriptions_of(profile_))
      if (status) status = advertise(one);
    if (status)
      control.note(
          fmt::format("publishing {} and the other topics of the profile, obeying {}, until Ctrl-C; "
                      "waiting for a driver; {}",
                      profile_.odometry_topic, profile_.command_topic, link_.where()));
    PlantPace pace(steady_now, plant_.uptime(), control.note);
    while (status && !should_stop()) {
      const auto sample = plant_.next();
      status = sample ? publish_sample(*sample) : tl::unexpected(sample.error());
      if (status) status = publish_item(GazeboKind::Clock, GazeboClock{plant_.now()});
      wait(pace, should_stop);
    }
    return should_stop() ? Status() : status;
  }

 private:
  /// Run this check before publishing, because two simulations on the same topics would look like a single
  /// robot that jumps.
  Status check_no_other_simulation() {
    for (const GazeboTopic& topic : link_.topics()) {
      if (topic.name != profile_.odometry_topic) continue;
      return fail(
          ErrorCode::InvalidArgument,
          fmt::format("another program already publishes this topic, at {}; {}",
                      fmt::join(link_.publishers(topic.name), ", "), link_.where()),
          {.source = topic.name},
          "End that simulation, or set IGN_PARTITION to another name for this simulation and its driver.");
    }
    return {};
  }

  Status advertise(const GazeboSubscription& one) {
    const auto made = link_.advertise(one.topic, like(one.kind));
    if (!made) return tl::unexpected(made.error());
    publishers_[one.kind] = *made;
    return {};
  }

  /// A value of the type published on a topic.
  [[nodiscard]] GazeboValue like(GazeboKind kind) const {
    switch (kind) {
      case GazeboKind::Odometry:
        return Odometry{};
      case GazeboKind::Imu:
        return ImuSample{};
      case GazeboKind::Scan:
        return LaserScan{};
      case GazeboKind::Image:
        return CameraFrame{};
      case GazeboKind::CameraInfo:
        return GazeboCamera{{}, camera_};
      case GazeboKind::Gamepad:
        return GamepadState{};
      case GazeboKind::Truth:
        return GazeboPoses{};
      case GazeboKind::Clock:
        return GazeboClock{};
    }
    return GazeboClock{};
  }

  /// Publishes the value, if the profile specifies a topic for it.
  Status publish_item(GazeboKind kind, const GazeboValue& value) {
    const auto known = publishers_.find(kind);
    return known == publishers_.end() ? Status() : link_.publish(known->second, value);
  }

  Status publish_sample(const Sample& sample) {
    if (const auto* odometry = std::get_if<Odometry>(&sample))
      return publish_item(GazeboKind::Odometry, *odometry);
    if (const auto* imu = std::get_if<ImuSample>(&sample)) return publish_item(GazeboKind::Imu, *imu);
    if (const auto* scan = std::get_if<LaserScan>(&sample)) return publish_item(GazeboKind::Scan, *scan);
    if (const auto* truth = std::get_if<TruthPose>(&sample))
      return publish_item(GazeboKind::Truth,
                          GazeboPoses{truth->stamp, {{profile_.truth_model, truth->map_T_base}}});
    if (const auto* frame = std::get_if<CameraFrame>(&sample)) return take_image(*frame);
    return {};
  }

  Status take_image(const CameraFrame& frame) {
    Status status = publish_item(GazeboKind::CameraInfo, GazeboCamera{frame.stamp, camera_});
    return status ? publish_item(GazeboKind::Image, frame) : status;
  }

  /// Waits until real time reaches simulated time. On a busy computer, the simulation runs slower.
  void wait(PlantPace& pace, const std::function<bool()>& should_stop) {
    pace.leave_out(plant_.uptime());
    do {
      const auto message = link_.next(pace.ahead(plant_.uptime()));
      if (message) obey(*message);
    } while (pace.ahead(plant_.uptime()) > Duration(0) && !should_stop());
  }

  void obey(const GazeboMessage& message) {
    if (!message.value) return;
    const auto* order = std::get_if<StampedCommand>(&*message.value);
    if (order == nullptr || !std::isfinite(order->command.speed_m_s) ||
        !std::isfinite(order->command.yaw_rate_rad_s))
      return;
    (void)plant_.command(order->command);
  }

  GazeboLink& link_;
  GazeboProfile profile_;
  Plant& plant_;
  CameraModel camera_;
  std::map<GazeboKind, std::size_t> publishers_{};
};

}  // namespace

Status run_gazebo_robot_sim(GazeboLink& link, const GazeboProfile& profile, Plant& plant,
                            const CameraModel& camera, const JobControl& control) {
  return GazeboRobotSim(link, profile, plant, camera).run(control);
}

}  // namespace waymark
