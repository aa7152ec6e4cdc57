#include "waymark/replay/motion_consistency.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

/// Commands: batteries sag, and motors differ from their model by a share and by a time.
constexpr double kMotorShare = 0.25;
constexpr double kMotorTime_s = 0.2;
/// Each third of the window holds this share of the difference, or it does not last.
constexpr double kLastingShare = 0.25;
/// Deviations that count as the uncertainty of an estimate, and of a pose by the tags of one picture.
constexpr double kSigmas = 2;
constexpr double kPictureSigmas = 3;
/// Way [m^2] and turns [rad^2] that the first belief in a scale is worth.
constexpr double kWayPrior = 0.25;
constexpr double kTurnPrior = 0.05;
constexpr double kForget_m = 8;
/// An encoder of unknown scale, until it has been compared.
constexpr double kUnknownWay = 0.06;
constexpr double kUnknownTurn = 0.8;
/// Share of the commanded turn that an unknown robot turns, and how uncertain that is.
constexpr double kCommandGain = 0.7;
constexpr double kUnknownCommand = 0.6;
constexpr double kGap_s = 0.3;
/// What is slow, or comes and goes, shows over a longer window.
constexpr double kLongWindow_s = 3;
constexpr Duration kHistory = std::chrono::seconds(10);

struct Cut {
  const MotionSample& from;
  const MotionSample& to;
};

double straight(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

double turned_by_tags(const Cut& cut) {
  return straight(cut.to.map_T_base.yaw() - cut.from.map_T_base.yaw());
}
double turned_by_odometry(const Cut& cut) {
  return straight(cut.to.odom_T_base.yaw() - cut.from.odom_T_base.yaw());
}

/// The way of the tags beside that of odometry, in the base at the beginning.
Eigen::Vector2d apart(const Cut& cut) {
  const SE2 by_tags = cut.from.map_T_base.inverse() * cut.to.map_T_base;
  const SE2 by_odometry = cut.from.odom_T_base.inverse() * cut.to.odom_T_base;
  return by_tags.translation() - by_odometry.translation();
}

/// Deviation of both poses of a cut along a direction of the map [m].
double position_sigma(const Cut& cut, const Eigen::Vector2d& map_direction) {
  const Eigen::Matrix2d P =
      cut.from.covariance.topLeftCorner<2, 2>() + cut.to.covariance.topLeftCorner<2, 2>();
  return std::sqrt(std::max(0.0, map_direction.dot(P * map_direction)));
}
/// The larger of the estimates': their errors go together. Those of two pictures do not.
double yaw_sigma(const Cut& cut) {
  return std::sqrt(std::max(0.0, cut.from.covariance(2, 2) + cut.to.covariance(2, 2)));
}

/// Larger deviation of the position of a pose [m].
double largest_sigma(const MotionSample& sample) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(sample.covariance.topLeftCorner<2, 2>(),
                                                            Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, axes.eigenvalues().maxCoeff()));
}

/// What a wrong scale, a wrong heading at the beginning and the noise of both poses make of the difference of
/// the ways by tags and by odometry, along a direction of the base at the beginning [m].
double doubt_of_way(const Cut& cut, const Eigen::Vector2d& direction, const MotionScales& scales) {
  const Eigen::Vector2d way = (cut.from.odom_T_base.inverse() * cut.to.odom_T_base).translation();
  const Eigen::Vector2d across(-way.y(), way.x());
  const double bend = scales.gyro ? 0.0 : scales.turn_share * (cut.to.turned_rad - cut.from.turned_rad) / 2;
  const double aside = std::sqrt(std::max(0.0, cut.from.covariance(2, 2))) * direction.dot(across);
  const double noise = std::hypot(position_sigma(cut, cut.from.map_T_base.rotation() * direction), aside);
  constexpr double kHeadingShare = 0.02;  // wheels that are not aligned
  return scales.distance_share * std::abs(direction.dot(way)) +
         (kHeadingShare + bend) * std::abs(direction.dot(across)) + scales.sigmas * noise;
}

/// The window in three parts of equal time of motion; the whole stands first.
std::array<Cut, 4> cuts_of(const std::vector<MotionSample>& window) {
  const double begin = window.front().moving_s;
  const double third = (window.back().moving_s - begin) / 3;
  const auto at = [&](double moving_s) -> const MotionSample& {
    return *std::ranges::lower_bound(window, moving_s - 1e-9, {}, &MotionSample::moving_s);
  };
  const MotionSample& one = at(begin + third);
  const MotionSample& two = at(begin + 2 * third);
  return {Cut{window.front(), window.back()}, Cut{window.front(), one}, Cut{one, two},
          Cut{two, window.back()}};
}

/// Whether the difference of the whole is above its limit, and every third has its share of it.
template <class Difference>
bool lasts(const std::array<Cut, 4>& cuts, double limit, const Difference& difference) {
  const double whole = difference(cuts[0]);
  if (!(std::abs(whole) > limit)) return false;
  return std::all_of(cuts.begin() + 1, cuts.end(), [&](const Cut& part) {
    return difference(part) * (whole > 0 ? 1 : -1) >= kLastingShare * std::abs(whole);
  });
}

std::optional<Contradiction> commands_and_wheels(const std::array<Cut, 4>& cuts,
                                                 const ConsistencyOptions& options) {
  const auto difference = [](const Cut& c) {
    return (c.to.wheels_m - c.from.wheels_m) - (c.to.commanded_m - c.from.commanded_m);
  };
  const Cut& all = cuts[0];
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
std::optional<Contradiction> commanded_and_turned(const std::array<Cut, 4>& cuts, const MotionScales& scales,
                                                  const ConsistencyOptions& options) {
  const auto commanded = [&](const Cut& c) {
    return scales.command_scale * (c.to.commanded_rad - c.from.commanded_rad);
  };
  const auto turned = [&](const Cut& c) {
    return scales.gyro ? c.to.gyro_rad - c.from.gyro_rad : c.to.wheels_rad - c.from.wheels_rad;
  };
  const auto difference = [&](const Cut& c) { return turned(c) - commanded(c); };
  const Cut& all = cuts[0];
  const double limit = options.contradiction_rad + scales.command_share * std::abs(commanded(all)) +
                       kMotorTime_s * (all.to.ramp_rad_s - all.from.ramp_rad_s);
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

std::optional<Contradiction> wheels_and_gyro(const std::array<Cut, 4>& cuts, const MotionScales& scales,
                                             const ConsistencyOptions& options) {
  if (!scales.gyro) return std::nullopt;
  const auto wheels = [&](const Cut& c) { return scales.turn_scale * (c.to.wheels_rad - c.from.wheels_rad); };
  const auto gyro = [](const Cut& c) { return c.to.gyro_rad - c.from.gyro_rad; };
  const auto difference = [&](const Cut& c) { return gyro(c) - wheels(c); };
  const Cut& all = cuts[0];
  const double larger = std::max(std::abs(wheels(all)), std::abs(gyro(all)));
  const double limit = options.contradiction_rad + scales.turn_share * larger;
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

std::optional<Contradiction> turns_and_tags(const std::array<Cut, 4>& cuts, const MotionScales& scales,
                                            const ConsistencyOptions& options) {
  const Cut& all = cuts[0];
  const auto difference = [](const Cut& c) { return straight(turned_by_tags(c) - turned_by_odometry(c)); };
  const double share = scales.gyro ? 0.05 : scales.turn_share;
  const double turned = all.to.turned_rad - all.from.turned_rad;
  const double limit = options.contradiction_rad + share * turned + scales.sigmas * yaw_sigma(all);
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

std::optional<Contradiction> ways_and_tags(const std::array<Cut, 4>& cuts, const MotionScales& scales,
                                           const ConsistencyOptions& options) {
  const Cut& all = cuts[0];
  const Eigen::Vector2d whole = apart(all);
  const Eigen::Vector2d direction = whole.normalized();
  const auto difference = [&](const Cut& c) {
    const double turn = straight(c.from.map_T_base.yaw() - all.from.map_T_base.yaw());
    return direction.dot(Eigen::Rotation2Dd(turn) * apart(c));
  };
  const double limit = options.contradiction_m + doubt_of_way(all, direction, scales);
  if (whole.norm() <= limit || !lasts(cuts, limit, difference)) return std::nullopt;
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
  constexpr double kGyroShare = 0.05;
  const double by_tags = turned_by_tags(cut);
  const double by_odometry = turned_by_odometry(cut);
  const double turned = cut.to.turned_rad - cut.from.turned_rad;
  const double apart_rad =
      scales.gyro ? std::abs(straight(by_tags - by_odometry)) : beyond(by_tags, by_odometry);
  const double share = scales.gyro ? kGyroShare : scales.turn_share;
  if (!(apart_rad > options.pushed_rad + share * turned + scales.sigmas * yaw_sigma(cut)))
    return std::nullopt;
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
  if (!(apart_rad > options.pushed_rad + kRamp_s * (cut.to.ramp_rad_s - cut.from.ramp_rad_s)))
    return std::nullopt;
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
  if (!(rest.norm() > options.pushed_m + doubt_of_way(cut, rest.normalized(), scales))) return std::nullopt;
  return Contradiction{.one = MotionSource::Wheels,
                       .other = MotionSource::Tags,
                       .carried = true,
                       .one_moved = by_odometry.norm(),
                       .other_moved = by_tags.norm(),
                       .apart = rest.norm()};
}

std::optional<Contradiction> tags_and_odometry(const std::array<Cut, 4>& cuts, const MotionScales& scales,
                                               const ConsistencyOptions& options) {
  if (!std::ranges::all_of(cuts, [](const Cut& cut) { return cut.from.tags && cut.to.tags; }))
    return std::nullopt;
  if (auto turning = turns_and_tags(cuts, scales, options)) return turning;
  return ways_and_tags(cuts, scales, options);
}

const char* name_of(MotionSource source) {
  constexpr std::array<const char*, 4> kNames{"commands", "wheels", "gyro", "tags"};
  return kNames[static_cast<std::size_t>(source)];
}

std::string explanation(const Contradiction& found) {
  if (found.carried && found.one == MotionSource::Wheels && !found.turning)
    return "Slipping wheels do not explain it: was the robot carried, or do the encoders stand still?";
  if (found.carried) return "Neither commands nor slipping wheels explain it: was the robot carried?";
  if (found.one == MotionSource::Commands && found.turning)
    return "Is the robot held or blocked, or do the motors not obey?";
  if (found.one == MotionSource::Commands) return "The wheels are blocked, or the motors do not obey.";
  if (found.culprit == MotionSource::Gyro) return "The tags say that the gyro is wrong.";
  if (found.culprit == MotionSource::Wheels)
    return found.other == MotionSource::Gyro
               ? "The tags say that the wheels are wrong: do they spin?"
               : "The gyro agrees with the tags: do the wheels spin, is the robot "
                 "held, or was it carried?";
  if (found.one == MotionSource::Gyro)
    return "Does the gyro stand still, is the robot held, does the camera repeat an old picture, or are its "
           "pictures late?";
  return "Do the wheels spin, is the robot held or was it carried, or does the camera repeat an old picture?";
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
  const bool turning = turn > options.contradiction_rad + 2 * kSigmas * yaw_sigma(cut) / std::numbers::sqrt2;
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

std::string to_words(const Contradiction& found) {
  if (found.late_s > 0)
    return fmt::format(
        "turns seen by tags follow those of the {} by {:.2f} s: the pictures are stamped too late. Stamp "
        "them "
        "with the middle of their exposure, or give their delay (--camera-latency-s). Look at the robot, "
        "then "
        "resume",
        name_of(found.one), found.late_s);
  const auto amount = [&](double moved) {
    return found.turning ? fmt::format("{:.0f} deg", to_degrees(moved)) : fmt::format("{:.2f} m", moved);
  };
  return fmt::format(
      "{} and {} disagree: {} against {} in {:.1f} s, {} apart. {} Look at the robot, then resume",
      name_of(found.one), name_of(found.other), amount(found.one_moved), amount(found.other_moved),
      found.over_s, amount(found.apart), explanation(found));
}

void MotionConsistency::add(const Odometry& odometry) {
  if (odometry_) {
    const SE2 moved = odometry_->odom_T_base.inverse() * odometry.odom_T_base;
    const double gap_s = to_seconds(odometry.stamp - odometry_->stamp);
    if (!(gap_s > 0 && gap_s < 1)) {  // another clock, or a gap that nobody can bridge
      samples_.clear();
      history_.clear();
      headings_.clear();
      forget_pictures();
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
}

void MotionConsistency::add(const ImuSample& imu) {
  const double dt_s = imu_ ? to_seconds(imu.stamp - *imu_) : 0;
  imu_ = imu.stamp;
  if (!(dt_s > 0 && dt_s < kGap_s)) return;
  const double turned = imu.angular_velocity_rad_s.z() * dt_s;
  now_.gyro_rad += turned;
  now_.odom_T_base = now_.odom_T_base * SE2(0, 0, turned);
}

void MotionConsistency::command(const VelocityCommand& sent, double dt_s) {
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

void MotionConsistency::observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags) {
  now_.map_T_base = map_T_base;
  now_.covariance = covariance;
  now_.tags = tags;
  estimated_ = true;
  keep();
}

void MotionConsistency::observe_nothing() {
  now_.tags = false;
  if (estimated_) keep();
}

/// Standing adds nothing: the sample before it stays the newest, so that the next motion is held against it.
void MotionConsistency::keep() {
  constexpr double kCreep_m_s = 0.01;
  constexpr double kCreep_rad_s = 0.05;
  if (samples_.empty()) {
    learnt_to_.reset();
    return samples_.push_back(now_);
  }
  const MotionSample& last = samples_.back();
  const bool moves = std::abs(motor_m_s_) > kCreep_m_s ||
                     std::abs(now_.path_m - last.path_m) > kCreep_m_s * dt_s_ ||
                     std::abs(now_.turned_rad - last.turned_rad) > kCreep_rad_s * dt_s_;
  constexpr double kStood_s = 0.3;
  if (!moves) {
    stood_s_ += dt_s_;
    if (stood_s_ > kStood_s) forget_pictures();
    return;
  }
  if (stood_s_ > kStood_s) carried_ = find_carry(last, now_, stood_s_, options_);
  stood_s_ = 0;
  now_.moving_s += dt_s_;
  samples_.push_back(now_);
  while (samples_.size() > 2 &&
         samples_[1].moving_s <= now_.moving_s - std::max(options_.window_s, kLongWindow_s)) {
    learn(samples_.front());
    samples_.pop_front();
  }
}

/// From the motion that has left the window, half a metre at a time.
void MotionConsistency::learn(const MotionSample& gone) {
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
  distance_scale_ = std::clamp((way_tags_ + kWayPrior) / (way_way_ + kWayPrior), 0.85, 1.15);
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

MotionScales MotionConsistency::scales() const {
  MotionScales scales;
  scales.gyro = imu_ && odometry_ && std::abs(to_seconds(odometry_->stamp - *imu_)) < kGap_s;
  scales.distance_share += kUnknownWay * kWayPrior / (kWayPrior + way_way_);
  scales.turn_share += kUnknownTurn * kTurnPrior / (kTurnPrior + turn_turn_);
  scales.turn_scale = (turn_true_ + kTurnPrior) / (turn_turn_ + kTurnPrior);
  scales.command_scale = (command_true_ + kCommandGain * kTurnPrior) / (command_command_ + kTurnPrior);
  scales.command_share += kUnknownCommand * kTurnPrior / (kTurnPrior + command_command_);
  return scales;
}

/// The sums at a moment that lies between two samples of odometry, or just after the newest.
std::optional<MotionSample> MotionConsistency::sums_at(SensorTime stamp) const {
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
        &MotionSample::gyro_rad, &MotionSample::path_m, &MotionSample::turned_rad})
    sums.*sum = a.*sum + share * (b.*sum - a.*sum);
  sums.odom_T_base = a.odom_T_base * SE2::exp(share * (a.odom_T_base.inverse() * b.odom_T_base).log());
  return sums;
}

void MotionConsistency::forget_pictures() {
  pictures_.clear();
  suspected_.reset();
  pictured_.reset();
}

void MotionConsistency::observe_picture(SensorTime stamp, const SE2& map_T_base,
                                        const Eigen::Matrix3d& covariance, bool accepted) {
  std::optional<MotionSample> picture = sums_at(stamp);
  if (!picture) return;
  add_heading(stamp, map_T_base.yaw());
  if (pictures_.empty()) picture_zero_ = stamp;
  picture->moving_s = to_seconds(stamp - picture_zero_);
  picture->map_T_base = map_T_base;
  picture->covariance = covariance;
  picture->tags = true;
  if (!pictures_.empty() && picture->moving_s <= pictures_.back().moving_s) return;
  pictures_.push_back(*picture);
  while (picture->moving_s - pictures_.front().moving_s > kLongWindow_s + kGap_s) pictures_.pop_front();
  std::optional<Contradiction> found = contradiction_of_pictures();
  if (!found && accepted) found = push_of_pictures();
  if (found && suspected_) pictured_ = found;
  suspected_ = found;
}

void MotionConsistency::add_heading(SensorTime stamp, double yaw_rad) {
  constexpr double kUnseen_s = 1;  // longer, and nobody knows how often it turned round
  const double time_s = to_seconds(stamp - *zero_);
  if (!headings_.empty() && time_s <= headings_.back().time_s) return;
  if (!headings_.empty() && time_s - headings_.back().time_s > kUnseen_s) headings_.clear();
  const double before = headings_.empty() ? yaw_rad : headings_.back().yaw_rad;
  headings_.push_back({time_s, before + straight(yaw_rad - before)});
  look_for_delay();
}

/// Now and then: whether turns seen by tags follow those of odometry.
void MotionConsistency::look_for_delay() {
  constexpr std::size_t kEvery = 8;
  constexpr std::size_t kKept = 120;
  constexpr double kMost_s = 0.8;
  if (headings_.size() < kKept) return;
  std::vector<HeadingAt> turned;
  const bool gyro = scales().gyro;
  for (const StampedSums& at : history_)
    turned.push_back({to_seconds(at.stamp - *zero_), gyro ? at.sums.gyro_rad : at.sums.wheels_rad});
  const auto found = find_delay(headings_, turned, kMost_s);
  headings_.erase(headings_.begin(), headings_.begin() + kEvery);
  if (!found || found->delay_s < options_.late_pictures_s) return;
  late_ = Contradiction{.one = gyro ? MotionSource::Gyro : MotionSource::Wheels,
                        .other = MotionSource::Tags,
                        .turning = true,
                        .apart = found->rms_undelayed_rad,
                        .late_s = found->delay_s};
}

/// Over windows that grow: what is fast shows in the shortest.
std::optional<Contradiction> MotionConsistency::contradiction_of_pictures() const {
  MotionScales known = scales();
  known.sigmas = kPictureSigmas;
  const double now = pictures_.back().moving_s;
  for (const double longer : {1.0, 1.5, 2.0, 3.0}) {
    const double begin = now - longer * options_.window_s;
    const auto first = std::ranges::upper_bound(pictures_, begin + 1e-9, {}, &MotionSample::moving_s);
    if (first == pictures_.begin()) return std::nullopt;
    const auto from = std::prev(first);
    const auto silent = [](const MotionSample& a, const MotionSample& b) {
      return b.moving_s - a.moving_s > kGap_s;
    };
    if (begin - from->moving_s > kGap_s ||
        std::adjacent_find(from, pictures_.end(), silent) != pictures_.end())
      return std::nullopt;
    if (auto found = find_tag_contradiction({from, pictures_.end()}, known, options_)) return found;
  }
  return std::nullopt;
}

/// Against two pictures of a moment ago, so that one wrong picture says nothing.
std::optional<Contradiction> MotionConsistency::push_of_pictures() const {
  MotionScales known = scales();
  known.sigmas = kPictureSigmas;
  const MotionSample& newest = pictures_.back();
  for (const double part : {0.5, 1.0}) {
    const auto first = std::ranges::lower_bound(pictures_, newest.moving_s - part * options_.window_s - 1e-9,
                                                {}, &MotionSample::moving_s);
    if (pictures_.end() - first < 4) continue;
    const auto found = find_push(*first, newest, known, options_);
    if (found && find_push(*std::next(first), newest, known, options_)) return found;
  }
  return std::nullopt;
}

std::optional<Contradiction> MotionConsistency::contradiction() const {
  if (carried_) return carried_;
  if (samples_.empty()) return std::nullopt;
  const auto newest = std::ranges::lower_bound(samples_, samples_.back().moving_s - options_.window_s - 1e-9,
                                               {}, &MotionSample::moving_s);
  if (auto found = find_contradiction({newest, samples_.end()}, scales(), options_)) return found;
  if (pictured_) return pictured_;
  if (late_) return late_;
  ConsistencyOptions longer = options_;
  longer.window_s = std::max(options_.window_s, kLongWindow_s);
  return find_contradiction({samples_.begin(), samples_.end()}, scales(), longer);
}

}  // namespace waymark
