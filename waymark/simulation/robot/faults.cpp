#include "waymark/simulation/robot/faults.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr std::array<std::pair<FaultKind, std::string_view>, 16> kNames{{
    {FaultKind::CameraBlackout, "camera_blackout"},
    {FaultKind::CameraFrozen, "camera_frozen"},
    {FaultKind::CameraLost, "camera_lost"},
    {FaultKind::OdometryLost, "odometry_lost"},
    {FaultKind::TagMoved, "tag_moved"},
    {FaultKind::TagRemoved, "tag_removed"},
    {FaultKind::TagDuplicated, "tag_duplicated"},
    {FaultKind::TagsSwapped, "tags_swapped"},
    {FaultKind::Kidnapped, "kidnapped"},
    {FaultKind::ClockJump, "clock_jump"},
    {FaultKind::SlipBurst, "slip_burst"},
    {FaultKind::CameraStuck, "camera_stuck"},
    {FaultKind::WheelsBlocked, "wheels_blocked"},
    {FaultKind::RobotHeld, "robot_held"},
    {FaultKind::Carried, "carried"},
    {FaultKind::BatterySag, "battery_sag"},
}};

bool about_tags(FaultKind kind) {
  return kind == FaultKind::TagMoved || kind == FaultKind::TagRemoved || kind == FaultKind::TagDuplicated ||
         kind == FaultKind::TagsSwapped;
}

void apply(const Fault& fault, World& world) {
  const auto tag = world.tags.tags.find(fault.tag);
  if (tag == world.tags.tags.end()) return;  // the tag has already been removed
  SE3& map_T_tag = tag->second.map_T_tag;
  const auto other = world.tags.tags.find(fault.other);
  switch (fault.kind) {
    case FaultKind::TagMoved:
      map_T_tag = SE3(SO3::exp({0, 0, fault.turn_rad}) * map_T_tag.rotation(),
                      map_T_tag.translation() + fault.shift_m);
      break;
    case FaultKind::TagRemoved:
      world.tags.tags.erase(tag);
      break;
    case FaultKind::TagDuplicated:
      world.copies.push_back({fault.tag, {.map_T_tag = fault.map_T_copy, .size_m = tag->second.size_m}});
      break;
    case FaultKind::TagsSwapped:
      if (other != world.tags.tags.end()) std::swap(map_T_tag, other->second.map_T_tag);
      break;
    default:
      break;
  }
}

Status check_one(const Fault& fault, const World& world) {
  const auto no = [](std::string words) { return fail(ErrorCode::InvalidArgument, std::move(words)); };
  if (!(fault.at_s >= 0) || !std::isfinite(fault.at_s)) return no("`at_s` must be 0 or later");
  if (!(fault.for_s > 0)) return no("`for_s` must be above 0");
  if (!(fault.speed_share >= 0 && fault.speed_share <= 1) || !(fault.yaw_share >= 0 && fault.yaw_share <= 1))
    return no("a share must be between 0 and 1");
  if (!about_tags(fault.kind)) return {};
  for (const TagId& tag : {fault.tag, fault.kind == FaultKind::TagsSwapped ? fault.other : fault.tag}) {
    if (world.tags.find(tag) == nullptr)
      return no(fmt::format("{} is not among the tags of {}", to_string(tag), world.name));
  }
  return {};
}

}  // namespace

std::span<const std::pair<FaultKind, std::string_view>> fault_names() { return kNames; }

bool active(const Fault& fault, double now_s) {
  if (fault.kind == FaultKind::Kidnapped || now_s < fault.at_s) return false;
  return fault.kind == FaultKind::ClockJump || now_s < fault.at_s + fault.for_s;
}

bool active(std::span<const Fault> faults, FaultKind kind, double now_s) {
  return std::ranges::any_of(faults,
                             [&](const Fault& fault) { return fault.kind == kind && active(fault, now_s); });
}

World with_tag_faults(const World& world, std::span<const Fault> faults, double now_s) {
  World changed = world;
  for (const Fault& fault : faults) {
    if (about_tags(fault.kind) && active(fault, now_s)) apply(fault, changed);
  }
  return changed;
}

double next_tag_change_s(std::span<const Fault> faults, double now_s) {
  double next = kInfinity;
  for (const Fault& fault : faults) {
    if (!about_tags(fault.kind)) continue;
    for (const double moment : {fault.at_s, fault.at_s + fault.for_s}) {
      if (moment > now_s) next = std::min(next, moment);
    }
  }
  return next;
}

Status check(std::span<const Fault> faults, const World& world) {
  for (std::size_t i = 0; i < faults.size(); ++i) {
    if (Status status = check_one(faults[i], world); !status) {
      Error error = status.error();
      error.place.key = fmt::format("faults[{}]", i);
      return tl::unexpected(error);
    }
  }
  return {};
}

}  // namespace waymark
