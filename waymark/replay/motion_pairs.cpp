#include "waymark/replay/motion_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace waymark {
namespace {

using namespace internal;

/// Commands: batteries sag, and motors differ from their model by a share and by a time.
constexpr double kMotorShare = 0.25;
constexpr double kMotorTime_s = 0.2;
/// Deviations that count as the uncertainty of an estimate.
constexpr double kSigmas = 2;

std::optional<Contradiction> commands_and_wheels(const Cuts& cuts, const ConsistencyOptions& options) {
  const auto difference = [](const Cut& c) {
    return (c.to.wheels_m - c.from.wheels_m) - (c.to.commanded_m - c.from.commanded_m);
  };
  const Cut& all = cuts.whole;
  const double commanded = all.to.commanded_m - all.from.commanded_m;
  const double limit = options.contradiction_m + kMotorShare * std::abs(commanded) +
                       kMotorTime_s * (all.to.ramp_m_s - all.from.ramp_m_s);
  if (!lasts(cuts, limit, difference)) return std::nullopt;
  return Contradiction{.one = MotionSource::Commands,
                       .other = MotionSource::Wheels,
                       .one_moved = commanded,
                       .other_moved = all.to.wheels_m - all.from.wheels_m,
                       .apart = std::abs(difference(all))};
}

/// A robot that does not turn as it is asked, by as much as it has done so far.
std::optional<Contradiction> commanded_and_turned(const Cuts& cuts, const MotionScales& scales,
                                                  const ConsistencyOptions& options) {
  const auto commanded = [&](const Cut& c) {
    return scales.command_scale * (c.to.commanded_rad - c.from.commanded_rad);
  };
  const auto turned = [&](const Cut& c) {
    return scales.gyro ? c.to.gyro_rad - c.from.gyro_rad : c.to.wheels_rad - c.from.wheels_rad;
  };
  const auto difference = [&](const Cut& c) { return turned(c) - commanded(c); };
  const Cut& all = cuts.whole;
  const double limit = options.contradiction_rad + scales.command_share * std::abs(commanded(all)) +
                       kMotorTime_s * (all.to.ramp_rad_s - all.from.ramp_rad_s) + turn_of_bias(all);
  // One that turns without being asked was pushed: find_push().
  const bool asked = std::abs(commanded(all)) > limit && commanded(all) * difference(all) < 0;
  if (!asked || !lasts(cuts, limit, difference)) return std::nullopt;
  return Contradiction{.one = MotionSource::Commands,
                       .other = scales.gyro ? MotionSource::Gyro : MotionSource::Wheels,
                       .turning = true,
                       .one_moved = all.to.commanded_rad - all.from.commanded_rad,
                       .other_moved = turned(all),
                       .apart = std::abs(difference(all))};
}

std::optional<Contradiction> wheels_and_gyro(const Cuts& cuts, const MotionScales& scales,
                                             const ConsistencyOptions& options) {
  if (!scales.gyro) return std::nullopt;
  const auto wheels = [&](const Cut& c) { return scales.turn_scale * (c.to.wheels_rad - c.from.wheels_rad); };
  const auto gyro = [](const Cut& c) { return c.to.gyro_rad - c.from.gyro_rad; };
  const auto difference = [&](const Cut& c) { return gyro(c) - wheels(c); };
  const Cut& all = cuts.whole;
  const double larger = std::max(std::abs(wheels(all)), std::abs(gyro(all)));
  const double limit = options.contradiction_rad +
                       std::hypot(scales.turn_share * larger, turn_noise(all, scales), turn_of_bias(all));
  if (!lasts(cuts, limit, difference)) return std::nullopt;
  Contradiction found{.one = MotionSource::Wheels,
                      .other = MotionSource::Gyro,
                      .turning = true,
                      .one_moved = wheels(all),
                      .other_moved = gyro(all),
                      .apart = std::abs(difference(all))};
  if (!all.from.tags || !all.to.tags) return found;
  const double tags = turned_by_tags(all);
  const bool with_wheels = std::abs(tags - found.one_moved) < found.apart / 3;
  const bool with_gyro = std::abs(tags - found.other_moved) < found.apart / 3;
  if (with_wheels) found.culprit = MotionSource::Gyro;
  if (with_gyro) found.culprit = MotionSource::Wheels;
  return found;
}

std::optional<Contradiction> turns_and_tags(const Cuts& cuts, const MotionScales& scales,
                                            const ConsistencyOptions& options) {
  const Cut& all = cuts.whole;
  const auto difference = [](const Cut& c) { return straight(turned_by_tags(c) - turned_by_odometry(c)); };
  const double limit = options.contradiction_rad + doubt_of_turn(all, scales);
  if (!lasts(cuts, limit, difference)) return std::nullopt;
  Contradiction found{.one = scales.gyro ? MotionSource::Gyro : MotionSource::Wheels,
                      .other = MotionSource::Tags,
                      .turning = true,
                      .one_moved = turned_by_odometry(all),
                      .other_moved = turned_by_tags(all),
                      .apart = std::abs(difference(all))};
  // The turn of odometry is no third source: most drivers make it of the same gyro.
  return found;
}

std::optional<Contradiction> ways_and_tags(const Cuts& cuts, const MotionScales& scales,
                                           const ConsistencyOptions& options) {
  const Cut& all = cuts.whole;
  const Eigen::Vector2d whole = apart(all);
  const Eigen::Vector2d direction = whole.normalized();
  const auto difference = [&](const Cut& c) {
    const double turn = straight(c.from.map_T_base.yaw() - all.from.map_T_base.yaw());
    return direction.dot(Eigen::Rotation2Dd(turn) * apart(c));
  };
  const double limit = options.contradiction_m + doubt_of_way(all, direction, scales);
  const Eigen::Vector2d map_direction = all.from.map_T_base.rotation() * direction;
  const auto deviation = [&](const Cut& c) { return position_sigma(c, map_direction); };
  if (whole.norm() <= limit || !lasts(cuts, limit, difference, deviation)) return std::nullopt;
  Contradiction found{.one = MotionSource::Wheels,
                      .other = MotionSource::Tags,
                      .one_moved = (all.from.odom_T_base.inverse() * all.to.odom_T_base).translation().norm(),
                      .other_moved = (all.from.map_T_base.inverse() * all.to.map_T_base).translation().norm(),
                      .apart = whole.norm()};
  // Tags that see the turn of the gyro are alive: then it is the wheels that are wrong.
  constexpr double kTellingTurn = 0.15;
  const double gyro = all.to.gyro_rad - all.from.gyro_rad;
  if (scales.gyro && std::abs(gyro) > kTellingTurn &&
      std::abs(turned_by_tags(all) - gyro) < std::abs(gyro) / 3)
    found.culprit = MotionSource::Wheels;
  return found;
}

/// How far a value lies outside of what lies between nothing and a turn.
double beyond(double value, double turn) {
  return std::max({0.0, value - std::max(0.0, turn), std::min(0.0, turn) - value});
}

/// A turn that the gyro does not know of, or that slipping wheels cannot have made.
std::optional<Contradiction> turned_unseen(const Cut& cut, const MotionScales& scales,
                                           const ConsistencyOptions& options) {
  const double by_tags = turned_by_tags(cut);
  const double by_odometry = turned_by_odometry(cut);
  const double apart_rad =
      scales.gyro ? std::abs(straight(by_tags - by_odometry)) : beyond(by_tags, by_odometry);
  if (!(apart_rad > options.pushed_rad + doubt_of_turn(cut, scales))) return std::nullopt;
  return Contradiction{.one = scales.gyro ? MotionSource::Gyro : MotionSource::Wheels,
                       .other = MotionSource::Tags,
                       .turning = true,
                       .carried = true,
                       .one_moved = by_odometry,
                       .other_moved = by_tags,
                       .apart = apart_rad};
}

/// A turn by the gyro beyond what was commanded.
std::optional<Contradiction> turned_unasked(const Cut& cut, const MotionScales& scales,
                                            const ConsistencyOptions& options) {
  if (!scales.gyro) return std::nullopt;
  constexpr double kMostGain = 1.3;
  constexpr double kRamp_s = 0.15;
  const double commanded = kMostGain * (cut.to.commanded_rad - cut.from.commanded_rad);
  const double turned = cut.to.gyro_rad - cut.from.gyro_rad;
  const double apart_rad = beyond(turned, commanded);
  const double ramp_rad = kRamp_s * (cut.to.ramp_rad_s - cut.from.ramp_rad_s);
  if (!(apart_rad > options.pushed_rad + ramp_rad + turn_of_bias(cut))) return std::nullopt;
  return Contradiction{.one = MotionSource::Commands,
                       .other = MotionSource::Gyro,
                       .turning = true,
                       .carried = true,
                       .one_moved = commanded / kMostGain,
                       .other_moved = turned,
                       .apart = apart_rad};
}

std::optional<Contradiction> pushed(const Cut& cut, const MotionScales& scales,
                                    const ConsistencyOptions& options) {
  const Eigen::Vector2d by_odometry = (cut.from.odom_T_base.inverse() * cut.to.odom_T_base).translation();
  const Eigen::Vector2d by_tags = (cut.from.map_T_base.inverse() * cut.to.map_T_base).translation();
  const double share =
      std::clamp(by_tags.dot(by_odometry) / std::max(1e-6, by_odometry.squaredNorm()), 0.0, 1.0);
  const Eigen::Vector2d rest = by_tags - share * by_odometry;
  const Eigen::Vector2d whole = by_tags - by_odometry;
  constexpr double kSudden = 1.8;  // what need not last may be a tag that hangs elsewhere
  const auto doubt = [&](const Eigen::Vector2d& way) {
    return kSudden * doubt_of_way(cut, way.normalized(), scales);
  };
  const bool slipped = whole.norm() > options.slipped_m + doubt(whole);
  const bool carried = rest.norm() > options.pushed_m + doubt(rest);
  if (!carried && !slipped) return std::nullopt;
  return Contradiction{.one = MotionSource::Wheels,
                       .other = MotionSource::Tags,
                       .carried = carried,
                       .one_moved = by_odometry.norm(),
                       .other_moved = by_tags.norm(),
                       .apart = carried ? rest.norm() : whole.norm()};
}

std::optional<Contradiction> tags_and_odometry(const Cuts& cuts, const MotionScales& scales,
                                               const ConsistencyOptions& options) {
  const auto tagged = [](const Cut& cut) { return cut.from.tags && cut.to.tags; };
  if (!std::ranges::all_of(cuts.by_time, tagged) || !std::ranges::all_of(cuts.by_way, tagged))
    return std::nullopt;
  if (auto turning = turns_and_tags(cuts, scales, options)) return turning;
  return ways_and_tags(cuts, scales, options);
}

}  // namespace

std::optional<Contradiction> find_contradiction(const std::vector<MotionSample>& window,
                                                const MotionScales& scales,
                                                const ConsistencyOptions& options) {
  constexpr double kStep_s = 0.1;
  if (window.size() < 4) return std::nullopt;
  const double over_s = window.back().moving_s - window.front().moving_s;
  if (over_s < options.window_s - kStep_s) return std::nullopt;
  const auto cuts = cuts_of(window);
  std::optional<Contradiction> found = commands_and_wheels(cuts, options);
  if (!found) found = wheels_and_gyro(cuts, scales, options);
  if (!found) found = commanded_and_turned(cuts, scales, options);
  if (!found) found = tags_and_odometry(cuts, scales, options);
  if (found) found->over_s = over_s;
  return found;
}

std::optional<Contradiction> find_tag_contradiction(const std::vector<MotionSample>& window,
                                                    const MotionScales& scales,
                                                    const ConsistencyOptions& options) {
  if (window.size() < 4) return std::nullopt;
  auto found = tags_and_odometry(cuts_of(window), scales, options);
  if (found) found->over_s = window.back().moving_s - window.front().moving_s;
  return found;
}

std::optional<Contradiction> find_push(const MotionSample& before, const MotionSample& after,
                                       const MotionScales& scales, const ConsistencyOptions& options) {
  if (!before.tags || !after.tags) return std::nullopt;
  const Cut cut{before, after};
  auto found = pushed(cut, scales, options);
  if (!found) found = turned_unseen(cut, scales, options);
  if (!found) found = turned_unasked(cut, scales, options);
  if (found) found->over_s = after.moving_s - before.moving_s;
  return found;
}

std::optional<Contradiction> find_carry(const MotionSample& before, const MotionSample& after, double stood_s,
                                        const ConsistencyOptions& options) {
  if (!before.tags || !after.tags) return std::nullopt;
  const Cut cut{before, after};
  const double way = apart(cut).norm();
  const double turn = std::abs(straight(turned_by_tags(cut) - turned_by_odometry(cut)));
  const double noise = 2 * kSigmas * yaw_sigma(cut) / std::numbers::sqrt2;
  const bool turning = turn > options.contradiction_rad + std::hypot(noise, turn_of_bias(cut));
  const double limit = options.contradiction_m + kSigmas * (largest_sigma(before) + largest_sigma(after));
  if (!turning && !(way > limit)) return std::nullopt;
  return Contradiction{.one = MotionSource::Wheels,
                       .other = MotionSource::Tags,
                       .turning = turning,
                       .one_moved = 0,
                       .other_moved = turning ? turned_by_tags(cut) : way,
                       .apart = turning ? turn : way,
                       .over_s = stood_s};
}

}  // namespace waymark
