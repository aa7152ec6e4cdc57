#include "waymark/robots/gazebo/gazebo_bridge.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace waymark {
namespace {

/// Whether a topic of this kind may carry the value.
bool fits(GazeboKind kind, const GazeboValue& value) {
  switch (kind) {
    case GazeboKind::Odometry:
      return std::holds_alternative<Odometry>(value);
    case GazeboKind::Imu:
      return std::holds_alternative<ImuSample>(value);
    case GazeboKind::Scan:
      return std::holds_alternative<LaserScan>(value);
    case GazeboKind::Image:
      return std::holds_alternative<CameraFrame>(value);
    case GazeboKind::CameraInfo:
      return std::holds_alternative<GazeboCamera>(value);
    case GazeboKind::Gamepad:
      return std::holds_alternative<GamepadState>(value);
    case GazeboKind::Truth:
      return std::holds_alternative<GazeboPoses>(value);
    case GazeboKind::Clock:
      return std::holds_alternative<GazeboClock>(value);
  }
  return false;
}

std::optional<Sample> sample_of(const GazeboValue& value) {
  return std::visit(
      [](const auto& one) -> std::optional<Sample> {
        if constexpr (std::is_constructible_v<Sample, decltype(one)>)
          return Sample(one);
        else
          return std::nullopt;
      },
      value);
}

}  // namespace

GazeboBridge::GazeboBridge(const GazeboProfile& profile, RobotDescription robot, PutImage put_image)
    : robot_(std::move(robot)),
      truth_model_(profile.truth_model),
      lines_("Gazebo", robot_.model.name, std::move(put_image)) {}

std::vector<std::string> GazeboBridge::receive(const GazeboSubscription& from, const GazeboMessage& message) {
  const bool needs_clock = from.kind != GazeboKind::CameraInfo && from.kind != GazeboKind::Odometry;
  if (from.kind == GazeboKind::Clock || (needs_clock && !speaks())) return {};
  auto lines = lines_of(from, message);
  if (lines) return std::move(*lines);
  lines_.drop(from.topic, lines.error());
  return {};
}

Result<std::vector<std::string>> GazeboBridge::lines_of(const GazeboSubscription& from,
                                                        const GazeboMessage& message) {
  if (!message.value) return tl::unexpected(message.value.error());
  const GazeboValue& value = *message.value;
  if (!fits(from.kind, value))
    return fail(ErrorCode::Unreadable, fmt::format("its type is {}, expected {}", message.type, from.type));
  if (const auto* info = std::get_if<GazeboCamera>(&value)) {
    if (std::string difference = camera_difference(info->camera, robot_); !difference.empty())
      lines_.report_once(std::move(difference));
    return std::vector<std::string>();
  }
  if (const auto* poses = std::get_if<GazeboPoses>(&value)) return truth(from, *poses);
  auto sample = sample_of(value);
  return sample ? line_of(from, std::move(*sample)) : std::vector<std::string>();
}

Result<std::vector<std::string>> GazeboBridge::truth(const GazeboSubscription& from,
                                                     const GazeboPoses& poses) {
  const auto named = [this](const GazeboPose& pose) { return pose.name == truth_model_; };
  const auto found = truth_model_.empty() ? poses.poses.begin() : std::ranges::find_if(poses.poses, named);
  if (found == poses.poses.end()) return std::vector<std::string>();  // the message is about another model
  return line_of(from, TruthPose{.stamp = poses.stamp, .map_T_base = found->world_T_model});
}

Result<std::vector<std::string>> GazeboBridge::line_of(const GazeboSubscription& from, Sample sample) {
  const bool leads = from.kind == GazeboKind::Odometry;
  const SensorTime stamp = stamp_of(sample);
  const Duration now = simulated_time_.value_or(stamp).time_since_epoch();
  auto line = lines_.line_of(std::move(sample), from.topic, leads ? stamp.time_since_epoch() : now, leads);
  if (!line) return tl::unexpected(line.error());
  if (leads) simulated_time_ = stamp;
  return std::vector<std::string>{std::move(*line)};
}

}  // namespace waymark
