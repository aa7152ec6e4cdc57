#include "waymark/replay/replay_watch.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace waymark {
std::string ReplayWatch::alarm() const {
  if (!alarm_.empty()) return alarm_;
  if (command_gap_)
    return fmt::format("no command was sent for {:.2f} s: this computer was overloaded, or a clock jumped",
                       to_seconds(command_gap_->to - command_gap_->from));
  for (const auto& [camera, shown] : shown_) {
    if (!shown.frozen_message.empty()) return shown.frozen_message;
  }
  return {};
}

void ReplayWatch::report_clock_jump(Duration by) {
  if (!alarm_.empty()) return;
  alarm_ = fmt::format(
      "the clock jumped by {:+.2f} s, so the motion since may be wrong. Check the robot, then start again",
      to_seconds(by));
}

void ReplayWatch::tick(SensorTime now) {
  if (tick_) {
    const double passed_s = to_seconds(now - *tick_);
    if (passed_s < 0) report_clock_jump(now - *tick_);
    if (passed_s > options_.clock_jump_s) command_gap_ = Gap{command_gap_ ? command_gap_->from : *tick_, now};
  }
  tick_ = now;
  decide_on_command_gap();
}

/// If a clock jumped, odometry has the same gap; if the computer was merely busy, it has none.
void ReplayWatch::decide_on_command_gap() {
  if (!command_gap_) return;
  if (odometry_gap_ && odometry_gap_->overlaps(*command_gap_)) {
    report_clock_jump(command_gap_->to - command_gap_->from);
    command_gap_.reset();
  } else if (odometry_ && to_seconds(command_gap_->to - odometry_->stamp) < options_.clock_jump_s) {
    command_gap_.reset();
  }
}

void ReplayWatch::add(const Odometry& odometry) {
  if (odometry_ && to_seconds(odometry.stamp - odometry_->stamp) > options_.clock_jump_s)
    odometry_gap_ = Gap{odometry_->stamp, odometry.stamp};
  odometry_ = odometry;
  decide_on_command_gap();
}

bool ReplayWatch::add(const TagFrame& frame) {
  std::vector<SeenTag> tags;
  for (const TagDetection& seen : frame.detections) {
    SeenTag& tag = tags.emplace_back(SeenTag{.tag = seen.tag});
    for (std::size_t i = 0; i < 4; ++i) {
      tag.numbers[2 * i] = seen.corners_px[i].x();
      tag.numbers[2 * i + 1] = seen.corners_px[i].y();
    }
  }
  return add(frame.stamp, frame.camera, tags);
}

bool ReplayWatch::add(const TagPoseFrame& frame) {
  std::vector<SeenTag> tags;
  for (const SeenTagPose& seen : frame.tags) {
    const Eigen::Vector3d& at = seen.cam_T_tag.translation();
    const Eigen::Quaterniond q = seen.cam_T_tag.rotation().quaternion();
    tags.push_back({seen.tag, {at.x(), at.y(), at.z(), q.w(), q.x(), q.y(), q.z()}});
  }
  return add(frame.stamp, frame.camera, tags);
}

bool ReplayWatch::add(SensorTime stamp, const std::string& camera, const std::vector<SeenTag>& tags) {
  constexpr double kMovedMetres = 0.01;
  constexpr double kMovedRadians = 0.005;
  const SE2 odom_T_base = odometry_ ? odometry_->odom_T_base : SE2();
  Shown& shown = shown_[camera];
  const SE2 moved = shown.odom_T_frame.inverse() * odom_T_base;
  const bool same = !tags.empty() && tags == shown.tags;
  if (!same) {
    shown = {.tags = tags, .odom_T_frame = odom_T_base, .since = stamp};
    return true;
  }
  const bool moves = moved.translation().norm() > kMovedMetres || std::abs(moved.yaw()) > kMovedRadians;
  if (!moves) return true;
  const double since_s = to_seconds(stamp - shown.since);
  if (since_s > options_.frozen_s)
    shown.frozen_message =
        fmt::format("the camera has repeated the same image for {:.1f} s while the robot moves", since_s);
  return false;
}

void ReplayWatch::check(const SE2& map_T_base) {
  if (!odometry_) return;
  if (map_T_checked_ && alarm_.empty()) {
    const SE2 by_odometry = odom_T_checked_.inverse() * odometry_->odom_T_base;
    const SE2 jump = by_odometry.inverse() * (map_T_checked_->inverse() * map_T_base);
    if (jump.translation().norm() > options_.carried_m || std::abs(jump.yaw()) > options_.carried_rad)
      alarm_ = fmt::format(
          "the position by tags jumped by {:.2f} m and {:.0f} deg relative to odometry. Was the robot moved "
          "by "
          "hand, or did the camera repeat an old image? Check the robot, then resume",
          jump.translation().norm(), std::abs(jump.yaw()) * 57.29577951308232);
  }
  map_T_checked_ = map_T_base;
  odom_T_checked_ = odometry_->odom_T_base;
}

void ReplayWatch::forget() {
  alarm_.clear();
  for (auto& [camera, shown] : shown_) shown.frozen_message.clear();
  tick_.reset();
  command_gap_.reset();
  odometry_gap_.reset();
  map_T_checked_.reset();
}

}  // namespace waymark
