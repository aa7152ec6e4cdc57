#include "waymark/replay/motion_consistency.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iterator>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "waymark/base/angles.hpp"
#include "waymark/geometry/dense.hpp"

namespace waymark {
namespace {

/// Two samples between which the sources are compared.
struct Cut {
  const MotionSample& from;
  const MotionSample& to;
};

/// A window and its division into thirds.
struct Cuts {
  Cut whole;
  std::array<Cut, 3> by_time;  ///< three periods of motion of equal duration
  std::array<Cut, 3> by_way;   ///< three sections of equal length as measured by the wheels
};

/// Whether the difference over the whole window exceeds its limit, and every third contains its share of it
/// to within one standard deviation of that third's difference. The thirds are equal in time or in distance:
/// for a robot that is slowing down, slip is proportional to distance.
template <class Difference, class Deviation>
bool persists(const Cuts& cuts, double limit, const Difference& difference, const Deviation& deviation) {
  constexpr double kLastingShare = 0.25;
  const double whole = difference(cuts.whole);
  if (!(std::abs(whole) > limit)) return false;
  const auto has_share = [&](const Cut& part) {
    return difference(part) * (whole > 0 ? 1 : -1) >= kLastingShare * std::abs(whole) - deviation(part);
  };
  return std::ranges::all_of(cuts.by_time, has_share) || std::ranges::all_of(cuts.by_way, has_share);
}

template <class Difference>
bool persists(const Cuts& cuts, double limit, const Difference& difference) {
  return persists(cuts, limit, difference, [](const Cut&) { return 0.0; });
}

/// Standard deviation of the positions at both ends along a direction in the map [m].
double position_sigma(const Cut& cut, const Eigen::Vector2d& map_direction) {
  const Eigen::Matrix2d P =
      cut.from.covariance.topLeftCorner<2, 2>() + cut.to.covariance.topLeftCorner<2, 2>();
  return std::sqrt(std::max(0.0, map_direction.dot(P * map_direction)));
}

/// The angle wrapped to [-pi, pi].
double straight(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

double turned_by_tags(const Cut& cut) {
  return straight(cut.to.map_T_base.yaw() - cut.from.map_T_base.yaw());
}

double turned_by_odometry(const Cut& cut) {
  return straight(cut.to.odom_T_base.yaw() - cut.from.odom_T_base.yaw());
}

/// Difference between the translations from tags and from odometry, in the base frame at the beginning.
Eigen::Vector2d apart(const Cut& cut) {
  const SE2 by_tags = cut.from.map_T_base.inverse() * cut.to.map_T_base;
  const SE2 by_odometry = cut.from.odom_T_base.inverse() * cut.to.odom_T_base;
  return by_tags.translation() - by_odometry.translation();
}

/// Standard deviation of the headings at both ends [rad].
/// For estimates it is the larger of the two, because their errors are correlated; the errors of two images
/// are not.
double yaw_sigma(const Cut& cut) {
  return std::sqrt(std::max(0.0, cut.from.covariance(2, 2) + cut.to.covariance(2, 2)));
}

/// Largest standard deviation of a pose's position [m].
double largest_sigma(const MotionSample& sample) {
  const Eigen::Vector2d variances_m2 = symmetric_eigenvalues<2>(sample.covariance.topLeftCorner<2, 2>());
  return std::sqrt(std::max(0.0, variances_m2.maxCoeff()));
}

/// Uncertainty of a turn measured by odometry due to its noise, at `sigmas` standard deviations [rad].
double turn_noise(const Cut& cut, const MotionScales& scales) {
  return scales.sigmas * scales.turn_noise_sqrt_m * std::sqrt(std::max(0.0, cut.to.path_m - cut.from.path_m));
}

/// Uncertainty of the turn measured by the gyro [rad] due to an unknown bias while the robot was stationary
/// or creeping. It grows with the gyro time in excess of the time in motion.
double turn_of_bias(const Cut& cut) {
  constexpr double kBias_rad_s = 0.01;
  const double moving_s = cut.to.moving_s - cut.from.moving_s;
  return kBias_rad_s * std::max(0.0, cut.to.gyro_s - cut.from.gyro_s - moving_s);
}

/// Uncertainty of the difference between the turns from odometry (with the gyro if there is one) and from
/// tags, due to scale and noise [rad]. Independent errors are added in quadrature, here and below.
double turn_uncertainty(const Cut& cut, const MotionScales& scales) {
  constexpr double kGyroShare = 0.05;
  const double turned = cut.to.turned_rad - cut.from.turned_rad;
  const double noise = scales.sigmas * yaw_sigma(cut);
  if (scales.gyro) return std::hypot(kGyroShare * turned, noise, turn_of_bias(cut));
  return std::hypot(scales.turn_share * scales.turn_scale * turned, turn_noise(cut, scales), noise);
}

/// Uncertainty [m] of the difference between the translations from tags and from odometry, along a direction
/// in the base frame at the beginning. It results from a wrong scale, a wrong initial heading and the noise
/// of both poses.
double distance_uncertainty(const Cut& cut, const Eigen::Vector2d& direction, const MotionScales& scales) {
  const Eigen::Vector2d way = (cut.from.odom_T_base.inverse() * cut.to.odom_T_base).translation();
  const Eigen::Vector2d across(-way.y(), way.x());
  constexpr double kEvenly = 0.58;  // 1 / sqrt(3), for a random walk over the distance
  const double turned = scales.turn_scale * (cut.to.turned_rad - cut.from.turned_rad);
  const double bend = scales.gyro
                          ? turn_of_bias(cut)
                          : std::hypot(scales.turn_share * turned / 2, kEvenly * turn_noise(cut, scales));
  const double aside = std::sqrt(std::max(0.0, cut.from.covariance(2, 2))) * direction.dot(across);
  const double noise = std::hypot(position_sigma(cut, cut.from.map_T_base.rotation() * direction), aside);
  constexpr double kHeadingShare = 0.02;  // wheels out of alignment
  return std::hypot(scales.distance_share * direction.dot(way),
                    std::hypot(kHeadingShare, bend) * direction.dot(across), scales.sigmas * noise);
}

Cuts cuts_of(const std::vector<MotionSample>& window) {
  const MotionSample& first = window.front();
  const MotionSample& last = window.back();
  const auto in_thirds = [&](double MotionSample::*const sum) -> std::array<Cut, 3> {
    const auto at = [&](double share) -> const MotionSample& {
      const double value = first.*sum + share * (last.*sum - first.*sum);
      return *std::ranges::lower_bound(window, value - 1e-9, {}, sum);
    };
    const MotionSample& one = at(1.0 / 3);
    const MotionSample& two = at(2.0 / 3);
    return {Cut{first, one}, Cut{one, two}, Cut{two, last}};
  };
  return {{first, last}, in_thirds(&MotionSample::moving_s), in_thirds(&MotionSample::path_m)};
}

/// Sums for fitting the line y = a + s x.
struct LineSums {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
};

std::optional<double> heading_at(std::span<const HeadingAt> all, double time_s) {
  const auto after = std::ranges::lower_bound(all, time_s, {}, &HeadingAt::time_s);
  if (after == all.begin() || after == all.end()) return std::nullopt;
  const HeadingAt& b = *after;
  const HeadingAt& a = *std::prev(after);
  return a.yaw_rad + (b.yaw_rad - a.yaw_rad) * (time_s - a.time_s) / (b.time_s - a.time_s);
}

struct Fit {
  double scale = 0;
  double rms_rad = 0;
};

std::optional<Fit> fit(std::span<const HeadingAt> images, std::span<const HeadingAt> odometry,
                       double camera_latency_s, double max_latency_s) {
  LineSums sums;
  for (const HeadingAt& seen : images) {
    if (!heading_at(odometry, seen.time_s - max_latency_s))
      continue;  // so that the same images are used for all latencies
    const auto turned = heading_at(odometry, seen.time_s - camera_latency_s);
    if (!turned) continue;
    const double x = *turned - odometry.front().yaw_rad;
    const double y = seen.yaw_rad - images.front().yaw_rad;
    sums.n += 1;
    sums.x += x;
    sums.y += y;
    sums.xx += x * x;
    sums.xy += x * y;
    sums.yy += y * y;
  }
  constexpr double kMinImages = 30;
  if (sums.n < kMinImages) return std::nullopt;
  const double xx = sums.xx - sums.x * sums.x / sums.n;
  const double xy = sums.xy - sums.x * sums.y / sums.n;
  const double yy = sums.yy - sums.y * sums.y / sums.n;
  constexpr double kTurned_rad = 0.1;
  if (xx < sums.n * kTurned_rad * kTurned_rad) return std::nullopt;
  return Fit{xy / xx, std::sqrt(std::max(0.0, yy - xy * xy / xx) / sums.n)};
}

}  // namespace

std::optional<CameraLatencyFit> find_camera_latency(std::span<const HeadingAt> images,
                                                    std::span<const HeadingAt> odometry,
                                                    double max_latency_s) {
  constexpr double kStep_s = 0.02;
  constexpr double kLeastScale = 0.15;
  constexpr double kMinResidual_rad = 0.03;  // smaller residuals need no latency to explain them
  constexpr double kBetter = 3;
  const auto without_latency = fit(images, odometry, 0, max_latency_s);
  if (!without_latency || without_latency->rms_rad < kMinResidual_rad) return std::nullopt;
  CameraLatencyFit best{.rms_rad = without_latency->rms_rad,
                        .rms_without_latency_rad = without_latency->rms_rad};
  double scale = without_latency->scale;
  for (double camera_latency_s = kStep_s; camera_latency_s < max_latency_s; camera_latency_s += kStep_s) {
    const auto found = fit(images, odometry, camera_latency_s, max_latency_s);
    if (!found || found->rms_rad >= best.rms_rad) continue;
    best.camera_latency_s = camera_latency_s;
    best.rms_rad = found->rms_rad;
    scale = found->scale;
  }
  const bool ends = best.camera_latency_s + 2 * kStep_s > max_latency_s;  // a longer one may fit even better
  if (ends || scale < kLeastScale || kBetter * best.rms_rad > best.rms_without_latency_rad)
    return std::nullopt;
  return best;
}

namespace {

/// Uncertainty of the commands: batteries sag, and motors deviate from their model by a fraction of the speed
/// and by a lag.
constexpr double kMotorShare = 0.25;
constexpr double kMotorTime_s = 0.2;
/// Number of standard deviations of an estimate that is taken as its uncertainty.
constexpr double kSigmas = 2;

std::optional<Contradiction> commands_and_wheels(const Cuts& cuts, const ConsistencyOptions& options) {
  const auto difference = [](const Cut& c) {
    return (c.to.wheels_m - c.from.wheels_m) - (c.to.commanded_m - c.from.commanded_m);
  };
  const Cut& all = cuts.whole;
  const double commanded = all.to.commanded_m - all.from.commanded_m;
  const double limit = options.contradiction_m + kMotorShare * std::abs(commanded) +
                       kMotorTime_s * (all.to.ramp_m_s - all.from.ramp_m_s);
  if (!persists(cuts, limit, difference)) return std::nullopt;
  return Contradiction{.one = MotionSource::Commands,
                       .other = MotionSource::Wheels,
                       .one_moved = commanded,
                       .other_moved = all.to.wheels_m - all.from.wheels_m,
                       .apart = std::abs(difference(all))};
}

/// The robot turns less than commanded, relative to how it has responded so far.
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
  // find_push() handles turns that were not commanded.
  const bool asked = std::abs(commanded(all)) > limit && commanded(all) * difference(all) < 0;
  if (!asked || !persists(cuts, limit, difference)) return std::nullopt;
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
  if (!persists(cuts, limit, difference)) return std::nullopt;
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
  const double limit = options.contradiction_rad + turn_uncertainty(all, scales);
  if (!persists(cuts, limit, difference)) return std::nullopt;
  Contradiction found{.one = scales.gyro ? MotionSource::Gyro : MotionSource::Wheels,
                      .other = MotionSource::Tags,
                      .turning = true,
                      .one_moved = turned_by_odometry(all),
                      .other_moved = turned_by_tags(all),
                      .apart = std::abs(difference(all))};
  // The turn from odometry is not a third source, because most drivers compute it from the same gyro.
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
  const double limit = options.contradiction_m + distance_uncertainty(all, direction, scales);
  const Eigen::Vector2d map_direction = all.from.map_T_base.rotation() * direction;
  const auto deviation = [&](const Cut& c) { return position_sigma(c, map_direction); };
  if (whole.norm() <= limit || !persists(cuts, limit, difference, deviation)) return std::nullopt;
  Contradiction found{.one = MotionSource::Wheels,
                      .other = MotionSource::Tags,
                      .one_moved = (all.from.odom_T_base.inverse() * all.to.odom_T_base).translation().norm(),
                      .other_moved = (all.from.map_T_base.inverse() * all.to.map_T_base).translation().norm(),
                      .apart = whole.norm()};
  // If tags confirm the turn measured by the gyro, the wheels are wrong.
  constexpr double kMinGyroTurn_rad = 0.15;
  const double gyro = all.to.gyro_rad - all.from.gyro_rad;
  if (scales.gyro && std::abs(gyro) > kMinGyroTurn_rad &&
      std::abs(turned_by_tags(all) - gyro) < std::abs(gyro) / 3)
    found.culprit = MotionSource::Wheels;
  return found;
}

/// Distance from a value to the interval between zero and a turn.
double outside_of_turn(double value, double turn) {
  return std::max({0.0, value - std::max(0.0, turn), std::min(0.0, turn) - value});
}

/// A turn that the gyro did not measure, or that slipping wheels cannot have caused.
std::optional<Contradiction> turned_unseen(const Cut& cut, const MotionScales& scales,
                                           const ConsistencyOptions& options) {
  const double by_tags = turned_by_tags(cut);
  const double by_odometry = turned_by_odometry(cut);
  const double apart_rad =
      scales.gyro ? std::abs(straight(by_tags - by_odometry)) : outside_of_turn(by_tags, by_odometry);
  if (!(apart_rad > options.pushed_rad + turn_uncertainty(cut, scales))) return std::nullopt;
  return Contradiction{.one = scales.gyro ? MotionSource::Gyro : MotionSource::Wheels,
                       .other = MotionSource::Tags,
                       .turning = true,
                       .carried = true,
                       .one_moved = by_odometry,
                       .other_moved = by_tags,
                       .apart = apart_rad};
}

/// A turn measured by the gyro that was not commanded.
std::optional<Contradiction> turned_unasked(const Cut& cut, const MotionScales& scales,
                                            const ConsistencyOptions& options) {
  if (!scales.gyro) return std::nullopt;
  constexpr double kMaxGain = 1.3;
  constexpr double kRamp_s = 0.15;
  const double commanded = kMaxGain * (cut.to.commanded_rad - cut.from.commanded_rad);
  const double turned = cut.to.gyro_rad - cut.from.gyro_rad;
  const double apart_rad = outside_of_turn(turned, commanded);
  const double ramp_rad = kRamp_s * (cut.to.ramp_rad_s - cut.from.ramp_rad_s);
  if (!(apart_rad > options.pushed_rad + ramp_rad + turn_of_bias(cut))) return std::nullopt;
  return Contradiction{.one = MotionSource::Commands,
                       .other = MotionSource::Gyro,
                       .turning = true,
                       .carried = true,
                       .one_moved = commanded / kMaxGain,
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
  constexpr double kSudden = 1.8;  // without a check for persistence, the cause may be a tag that has moved
  const auto uncertainty = [&](const Eigen::Vector2d& way) {
    return kSudden * distance_uncertainty(cut, way.normalized(), scales);
  };
  const bool slipped = whole.norm() > options.slipped_m + uncertainty(whole);
  const bool carried = rest.norm() > options.pushed_m + uncertainty(rest);
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

std::optional<Contradiction> find_carry(const MotionSample& before, const MotionSample& after,
                                        double standstill_s, const ConsistencyOptions& options) {
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
                       .over_s = standstill_s};
}

namespace {

const char* name_of(MotionSource source) {
  constexpr std::array<const char*, 4> kNames{"commands", "wheels", "gyro", "tags"};
  return kNames[static_cast<std::size_t>(source)];
}

std::string explanation(const Contradiction& found) {
  if (found.carried && found.one == MotionSource::Wheels && !found.turning)
    return "Wheel slip does not explain it. Was the robot moved by hand, or did the encoders stop counting?";
  if (found.carried) return "Neither commands nor wheel slip explain it. Was the robot moved by hand?";
  if (found.one == MotionSource::Commands && found.turning)
    return "Is the robot held or blocked, or do the motors not respond?";
  if (found.one == MotionSource::Commands) return "The wheels are blocked, or the motors do not respond.";
  if (found.culprit == MotionSource::Gyro) return "By the tags, the gyro is wrong.";
  if (found.culprit == MotionSource::Wheels)
    return found.other == MotionSource::Gyro ? "By the tags, the wheels are wrong. Do they spin?"
                                             : "The gyro agrees with the tags. Do the wheels spin, is the "
                                               "robot held, or was it moved by hand?";
  if (found.one == MotionSource::Gyro)
    return "Does the gyro repeat a value, is the robot held, does the camera repeat an old image, or are its "
           "images late?";
  return "Do the wheels spin, is the robot held, was it moved by hand, or does the camera repeat an old "
         "image?";
}

}  // namespace

std::string describe(const Contradiction& found) {
  if (found.repeats_s > 0)
    return fmt::format(
        "the {} has repeated the same value for {:.1f} s although another yaw rate was commanded. Check the "
        "robot, then resume",
        name_of(found.one), found.repeats_s);
  if (found.camera_latency_s > 0)
    return fmt::format(
        "turns observed with tags follow those of the {} by {:.2f} s: images are stamped too late. Stamp "
        "them "
        "with the middle of their exposure, or set `camera_latency_s`. Check the robot, then resume",
        name_of(found.one), found.camera_latency_s);
  const auto amount = [&](double moved) {
    return found.turning ? fmt::format("{:.0f} deg", to_degrees(moved)) : fmt::format("{:.2f} m", moved);
  };
  return fmt::format(
      "{} and {} disagree: {} against {} in {:.1f} s, {} apart. {} Check the robot, then resume",
      name_of(found.one), name_of(found.other), amount(found.one_moved), amount(found.other_moved),
      found.over_s, amount(found.apart), explanation(found));
}

namespace {

/// Weight of the initial scales, as squared distance [m^2] and squared turns [rad^2].
constexpr double kWayPrior = 0.25;
constexpr double kTurnPrior = 0.05;
constexpr double kForget_m = 8;
/// Ratio of actual to commanded turn for an unknown robot, and its uncertainty.
constexpr double kCommandGain = 0.7;
constexpr double kUnknownCommand = 0.6;
constexpr Duration kHistory = std::chrono::seconds(10);

}  // namespace

OdometryPrior odometry_prior(const Calibration& calibration) {
  constexpr double kWithin = 3;         // limit in standard deviations
  constexpr double kLeastShare = 0.02;  // route and load differ from those during calibration
  OdometryPrior prior;
  const auto take = [&](const char* name, double& scale, double& share) {
    const auto known = calibration.observable_value(name);
    if (!known || !(*known > 0)) return;
    scale = *known;
    share = std::min(share, std::max(kLeastShare, kWithin * calibration.values.at(name).sigma / *known));
  };
  take("odometry_scale", prior.distance_scale, prior.distance_share);
  take("yaw_scale", prior.turn_scale, prior.turn_share);
  prior.turn_noise_sqrt_m = calibration.observable_value("yaw_noise_rad_sqrt_m").value_or(0);
  return prior;
}

bool MotionSums::add(const Odometry& odometry) {
  bool follows = true;
  if (odometry_) {
    const SE2 moved = odometry_->odom_T_base.inverse() * odometry.odom_T_base;
    const double gap_s = to_seconds(odometry.stamp - odometry_->stamp);
    if (!(gap_s > 0 && gap_s < 1)) {  // the clock jumped, or the gap is too long to integrate over
      samples_.clear();
      history_.clear();
      follows = false;
    }
    now_.wheels_m += moved.x();
    now_.wheels_rad += moved.yaw();
    now_.path_m += moved.translation().norm();
    now_.turned_rad += std::abs(moved.yaw());
    const double turn = scales().gyro ? 0.0 : scales().turn_scale * moved.yaw();
    now_.odom_T_base =
        now_.odom_T_base * SE2::exp({distance_scale_ * moved.x(), distance_scale_ * moved.y(), turn});
  }
  odometry_ = odometry;
  if (!zero_) zero_ = odometry.stamp;
  history_.push_back({odometry.stamp, now_});
  while (odometry.stamp - history_.front().stamp > kHistory) history_.pop_front();
  return follows;
}

void MotionSums::add(const ImuSample& imu) {
  const double dt_s = imu_ ? to_seconds(imu.stamp - *imu_) : 0;
  imu_ = imu.stamp;
  ++repeats_;
  if (imu.angular_velocity_rad_s.z() != repeated_.angular_velocity_rad_s.z() || dt_s <= 0) {
    repeated_ = imu;
    repeats_ = 0;
    ramp_before_ = now_.ramp_rad_s;
  }
  if (!(dt_s > 0 && dt_s < kMotionGap_s)) return;
  const double turned = imu.angular_velocity_rad_s.z() * dt_s;
  now_.gyro_rad += turned;
  now_.gyro_s += dt_s;
  now_.odom_T_base = now_.odom_T_base * SE2(0, 0, turned);
}

double MotionSums::gyro_repeats_s() const {
  constexpr int kMinRepeats = 10;
  constexpr double kOtherwise_rad_s = 0.1;
  const bool otherwise = now_.ramp_rad_s - ramp_before_ > kOtherwise_rad_s;
  return imu_ && otherwise && repeats_ >= kMinRepeats ? to_seconds(*imu_ - repeated_.stamp) : 0;
}

void MotionSums::command(const VelocityCommand& sent, double dt_s) {
  dt_s_ = std::isfinite(dt_s) ? std::clamp(dt_s, 0.0, 0.5) : 0.0;
  const auto share = [&](double lag_s) { return lag_s > 0 ? 1 - std::exp(-dt_s_ / lag_s) : 1.0; };
  now_.ramp_m_s += std::abs(sent.speed_m_s - commanded_.speed_m_s);
  now_.ramp_rad_s += std::abs(sent.yaw_rate_rad_s - commanded_.yaw_rate_rad_s);
  commanded_ = sent;
  motor_m_s_ += (sent.speed_m_s - motor_m_s_) * share(actuators_.speed_lag_s);
  motor_rad_s_ += (sent.yaw_rate_rad_s - motor_rad_s_) * share(actuators_.yaw_rate_lag_s);
  now_.commanded_m += motor_m_s_ * dt_s_;
  now_.commanded_rad += motor_rad_s_ * dt_s_;
}

Standing MotionSums::observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags) {
  now_.map_T_base = map_T_base;
  now_.covariance = covariance;
  now_.tags = tags;
  estimated_ = true;
  return keep();
}

Standing MotionSums::observe_nothing() {
  now_.tags = false;
  return estimated_ ? keep() : Standing{};
}

/// A standstill adds no sample, so the next motion is compared with the last sample before the standstill.
Standing MotionSums::keep() {
  constexpr double kCreep_m_s = 0.01;
  constexpr double kCreep_rad_s = 0.05;
  if (samples_.empty()) {
    learnt_to_.reset();
    samples_.push_back(now_);
    return {};
  }
  const MotionSample& last = samples_.back();
  constexpr double kMinStandstill_s = 0.3;
  // A single encoder tick does not end a standstill; otherwise one carry would be split into parts smaller
  // than the noise.
  constexpr double kMoved_m = 0.005;
  constexpr double kMoved_rad = 0.05;
  const SE2 since = last.odom_T_base.inverse() * now_.odom_T_base;
  const bool creeps = standstill_s_ > kMinStandstill_s
                          ? since.translation().norm() > kMoved_m || std::abs(since.yaw()) > kMoved_rad
                          : std::abs(now_.path_m - last.path_m) > kCreep_m_s * dt_s_ ||
                                std::abs(now_.turned_rad - last.turned_rad) > kCreep_rad_s * dt_s_;
  if (!creeps && std::abs(motor_m_s_) <= kCreep_m_s) {
    standstill_s_ += dt_s_;
    return {.at_standstill = standstill_s_ > kMinStandstill_s};
  }
  Standing standing;
  if (standstill_s_ > kMinStandstill_s) standing.over = {last, now_, standstill_s_};
  standstill_s_ = 0;
  now_.moving_s += dt_s_;
  samples_.push_back(now_);
  while (samples_.size() > 2 && samples_[1].moving_s <= now_.moving_s - kept_s_) {
    learn(samples_.front());
    samples_.pop_front();
  }
  return standing;
}

/// Learns from motion that has left the window, half a metre at a time.
void MotionSums::learn(const MotionSample& gone) {
  constexpr double kStep_m = 0.3;
  constexpr double kStep_rad = 0.3;
  if (!gone.tags) return learnt_to_.reset();
  if (!learnt_to_) {
    learnt_to_ = gone;
    return;
  }
  const Cut cut{*learnt_to_, gone};
  const double path = gone.path_m - learnt_to_->path_m;
  const double turned = gone.turned_rad - learnt_to_->turned_rad;
  if (path < kStep_m && turned < kStep_rad) return;
  const double way =
      (cut.from.odom_T_base.inverse() * cut.to.odom_T_base).translation().norm() / distance_scale_;
  const double way_by_tags = (cut.from.map_T_base.inverse() * cut.to.map_T_base).translation().norm();
  const double keep = std::exp(-path / kForget_m);
  way_way_ = keep * way_way_ + way * way;
  way_tags_ = keep * way_tags_ + way * way_by_tags;
  const double known = odometry_prior_.distance_scale;
  const double scale = (way_tags_ + known * kWayPrior) / (way_way_ + kWayPrior);
  distance_scale_ = std::clamp(scale, 0.85 * known, 1.15 * known);
  const double wheels = cut.to.wheels_rad - cut.from.wheels_rad;
  const double truly = scales().gyro ? cut.to.gyro_rad - cut.from.gyro_rad : turned_by_tags(cut);
  turn_turn_ = keep * turn_turn_ + wheels * wheels;
  turn_true_ = keep * turn_true_ + wheels * truly;
  const double commanded = cut.to.commanded_rad - cut.from.commanded_rad;
  const double turned_by_robot = scales().gyro ? truly : wheels;
  command_command_ = keep * command_command_ + commanded * commanded;
  command_true_ = keep * command_true_ + commanded * turned_by_robot;
  learnt_to_ = gone;
}

MotionScales MotionSums::scales() const {
  MotionScales scales;
  scales.gyro = imu_ && odometry_ && std::abs(to_seconds(odometry_->stamp - *imu_)) < kMotionGap_s;
  const OdometryPrior& prior = odometry_prior_;
  scales.distance_share += prior.distance_share * kWayPrior / (kWayPrior + way_way_);
  scales.turn_share += prior.turn_share * kTurnPrior / (kTurnPrior + turn_turn_);
  scales.turn_scale = (turn_true_ + prior.turn_scale * kTurnPrior) / (turn_turn_ + kTurnPrior);
  scales.turn_noise_sqrt_m = prior.turn_noise_sqrt_m;
  scales.command_scale = (command_true_ + kCommandGain * kTurnPrior) / (command_command_ + kTurnPrior);
  scales.command_share += kUnknownCommand * kTurnPrior / (kTurnPrior + command_command_);
  return scales;
}

std::optional<MotionSample> MotionSums::at(SensorTime stamp) const {
  constexpr Duration kAfter = std::chrono::milliseconds(60);
  const auto after = std::ranges::lower_bound(history_, stamp, {}, &StampedSums::stamp);
  if (after == history_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  if (after == history_.end())
    return stamp - before->stamp < kAfter ? std::optional(before->sums) : std::nullopt;
  const double share = to_seconds(stamp - before->stamp) / to_seconds(after->stamp - before->stamp);
  const MotionSample& a = before->sums;
  const MotionSample& b = after->sums;
  MotionSample sums = b;
  for (double MotionSample::*const sum :
       {&MotionSample::commanded_m, &MotionSample::ramp_m_s, &MotionSample::commanded_rad,
        &MotionSample::ramp_rad_s, &MotionSample::wheels_m, &MotionSample::wheels_rad,
        &MotionSample::gyro_rad, &MotionSample::gyro_s, &MotionSample::path_m, &MotionSample::turned_rad})
    sums.*sum = a.*sum + share * (b.*sum - a.*sum);
  sums.odom_T_base = a.odom_T_base * SE2::exp(share * (a.odom_T_base.inverse() * b.odom_T_base).log());
  return sums;
}

void MotionSums::forget() {
  samples_.clear();
  standstill_s_ = 0;
}

namespace {

/// Number of standard deviations that is taken as the uncertainty of a pose from the tags in one image.
constexpr double kImageSigmas = 3;
/// Two out of this many images, and one more, must contradict, because noise may hide the contradiction in an
/// image between them.
constexpr std::size_t kSuspectedFor = 3;
/// Slowly varying or intermittent differences show up only over a longer window.
constexpr double kLongWindow_s = 3;

}  // namespace

MotionConsistency::MotionConsistency(const ConsistencyOptions& options, const ActuatorOptions& actuators,
                                     const OdometryPrior& odometry)
    : options_(options), sums_(actuators, odometry, std::max(options.window_s, kLongWindow_s)) {}

void MotionConsistency::add(const Odometry& odometry) {
  if (sums_.add(odometry)) return;
  headings_.clear();
  forget_images();
}

void MotionConsistency::observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags) {
  notice_standstill(sums_.observe(map_T_base, covariance, tags));
}

void MotionConsistency::observe_nothing() { notice_standstill(sums_.observe_nothing()); }

void MotionConsistency::notice_standstill(const Standing& standing) {
  if (standing.at_standstill) forget_images();
  if (const auto& over = standing.over)
    carried_ = find_carry(over->before, over->after, over->standstill_s, options_);
}

void MotionConsistency::forget() {
  sums_.forget();
  carried_.reset();
  forget_images();
  headings_.clear();
  latency_contradiction_.reset();
}

void MotionConsistency::forget_images() {
  images_.clear();
  suspected_ago_.reset();
  contradiction_in_images_.reset();
}

void MotionConsistency::observe_image(SensorTime stamp, const SE2& map_T_base,
                                      const Eigen::Matrix3d& covariance, bool accepted) {
  std::optional<MotionSample> image = sums_.at(stamp);
  if (!image) return;
  add_heading(stamp, map_T_base.yaw());
  if (images_.empty()) image_zero_ = stamp;
  image->moving_s = to_seconds(stamp - image_zero_);
  image->tags = true;
  if (!images_.empty() && image->moving_s <= images_.back().seen.moving_s) return;
  MotionSample estimated = *image;
  const MotionSample& now = sums_.now();
  estimated.map_T_base = now.map_T_base * (now.odom_T_base.inverse() * image->odom_T_base);
  estimated.covariance = now.covariance;
  estimated.tags = now.tags;
  image->map_T_base = map_T_base;
  image->covariance = covariance;
  images_.push_back({*image, estimated});
  while (image->moving_s - images_.front().seen.moving_s > kLongWindow_s + kMotionGap_s) images_.pop_front();
  std::optional<Contradiction> found = contradiction_of_images();
  if (!found && accepted) found = push_of_images();
  if (suspected_ago_ && ++*suspected_ago_ > kSuspectedFor) suspected_ago_.reset();
  if (!found) return;
  if (suspected_ago_) contradiction_in_images_ = found;
  suspected_ago_ = 0;
}

void MotionConsistency::add_heading(SensorTime stamp, double yaw_rad) {
  constexpr double kUnseen_s = 1;  // after a longer gap, the number of full turns is unknown
  const double time_s = to_seconds(stamp - *sums_.zero());
  if (!headings_.empty() && time_s <= headings_.back().time_s) return;
  if (!headings_.empty() && time_s - headings_.back().time_s > kUnseen_s) headings_.clear();
  const double before = headings_.empty() ? yaw_rad : headings_.back().yaw_rad;
  headings_.push_back({time_s, before + straight(yaw_rad - before)});
  check_camera_latency();
}

/// Runs once every kEvery images and checks whether turns from tags lag behind those from odometry.
void MotionConsistency::check_camera_latency() {
  constexpr std::size_t kEvery = 8;
  constexpr std::size_t kKept = 120;
  constexpr double kMaxCameraLatency_s = 0.8;
  constexpr double kBeyondNoise = 3;
  if (headings_.size() < kKept) return;
  std::vector<HeadingAt> turned;
  const bool gyro = sums_.scales().gyro;
  for (const StampedSums& at : sums_.history())
    turned.push_back({to_seconds(at.stamp - *sums_.zero()), gyro ? at.sums.gyro_rad : at.sums.wheels_rad});
  const auto found = find_camera_latency(headings_, turned, kMaxCameraLatency_s);
  headings_.erase(headings_.begin(), headings_.begin() + kEvery);
  if (!found || found->camera_latency_s < options_.late_images_s) return;
  // A random walk in the turns measured by the wheels also fits one latency better than another.
  const double path_m = sums_.history().back().sums.path_m - sums_.history().front().sums.path_m;
  const double walk_rad = gyro ? 0.0 : sums_.scales().turn_noise_sqrt_m * std::sqrt(path_m / 6);
  if (found->rms_without_latency_rad < kBeyondNoise * walk_rad) return;
  latency_contradiction_ = Contradiction{.one = gyro ? MotionSource::Gyro : MotionSource::Wheels,
                                         .other = MotionSource::Tags,
                                         .turning = true,
                                         .apart = found->rms_without_latency_rad,
                                         .camera_latency_s = found->camera_latency_s};
}

/// The newest image before a given time; `nullopt` if images were missing at that time or have been missing
/// since.
std::optional<MotionConsistency::ImageIterator> MotionConsistency::image_before(double moving_s) const {
  const auto time_of = [](const ImageEntry& image) { return image.seen.moving_s; };
  const auto after = std::ranges::upper_bound(images_, moving_s + 1e-9, {}, time_of);
  if (after == images_.begin()) return std::nullopt;
  const auto found = std::prev(after);
  const auto silent = [&](const ImageEntry& a, const ImageEntry& b) {
    return time_of(b) - time_of(a) > kMotionGap_s;
  };
  if (moving_s - time_of(*found) > kMotionGap_s ||
      std::adjacent_find(found, images_.end(), silent) != images_.end())
    return std::nullopt;
  return found;
}

/// Compares over windows of increasing length, because sudden differences show up in the shortest one. At the
/// beginning of a window, the estimate is usually more accurate than a single image, unless it has followed
/// slipping wheels.
std::optional<Contradiction> MotionConsistency::contradiction_of_images() const {
  MotionScales known = sums_.scales();
  known.sigmas = kImageSigmas;
  const double now = images_.back().seen.moving_s;
  for (const double longer : {1.0, 1.5, 2.0, 2.5, 3.0}) {
    const auto from = image_before(now - longer * options_.window_s);
    if (!from) return std::nullopt;
    std::vector<MotionSample> window;
    std::transform(*from, images_.end(), std::back_inserter(window),
                   [](const ImageEntry& image) { return image.seen; });
    if (auto found = find_tag_contradiction(window, known, options_)) return found;
    window.front() = (*from)->estimated;
    if (auto found = find_tag_contradiction(window, known, options_)) return found;
  }
  return std::nullopt;
}

/// Compares with two recent images, so that a single wrong image does not count as a contradiction.
std::optional<Contradiction> MotionConsistency::push_of_images() const {
  MotionScales known = sums_.scales();
  known.sigmas = kImageSigmas;
  const MotionSample& newest = images_.back().seen;
  for (const double part : {0.5, 1.0}) {
    const auto first =
        std::ranges::lower_bound(images_, newest.moving_s - part * options_.window_s - 1e-9, {},
                                 [](const ImageEntry& image) { return image.seen.moving_s; });
    if (images_.end() - first < 4) continue;
    const auto found = find_push(first->seen, newest, known, options_);
    if (found && find_push(std::next(first)->seen, newest, known, options_)) return found;
  }
  return std::nullopt;
}

std::optional<Contradiction> MotionConsistency::contradiction() const {
  if (carried_) return carried_;
  if (const double repeats_s = sums_.gyro_repeats_s(); repeats_s >= options_.window_s)
    return Contradiction{.one = MotionSource::Gyro,
                         .other = MotionSource::Commands,
                         .turning = true,
                         .repeats_s = repeats_s,
                         .culprit = MotionSource::Gyro};
  const std::deque<MotionSample>& samples = sums_.samples();
  if (samples.empty()) return std::nullopt;
  const auto newest = std::ranges::lower_bound(samples, samples.back().moving_s - options_.window_s - 1e-9,
                                               {}, &MotionSample::moving_s);
  if (auto found = find_contradiction({newest, samples.end()}, sums_.scales(), options_)) return found;
  if (contradiction_in_images_) return contradiction_in_images_;
  if (latency_contradiction_) return latency_contradiction_;
  ConsistencyOptions longer = options_;
  longer.window_s = std::max(options_.window_s, kLongWindow_s);
  return find_contradiction({samples.begin(), samples.end()}, sums_.scales(), longer);
}

}  // namespace waymark
