#include "waymark/replay/motion_consistency.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

/// Commands: batteries sag, and motors differ from their model by a share and by a time.
constexpr double kMotorShare = 0.25;
constexpr double kMotorTime_s = 0.2;
/// Each third of the window holds this share of the difference, or it does not last.
constexpr double kLastingShare = 0.2;
/// Deviations of an estimate that count as uncertainty.
constexpr double kSigmas = 2;
/// Way [m^2] and turns [rad^2] that the first belief in a scale is worth.
constexpr double kWayPrior = 0.25;
constexpr double kTurnPrior = 0.05;
constexpr double kForget_m = 8;
/// An encoder of unknown scale, until it has been compared.
constexpr double kUnknownWay = 0.06;
constexpr double kUnknownTurn = 0.8;
constexpr double kGap_s = 0.3;
/// What is slow, or comes and goes, shows over a longer window.
constexpr double kLongWindow_s = 3;

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
  const double limit = options.contradiction_rad + share * turned +
                       kSigmas * std::max(all.from.yaw_sigma_rad, all.to.yaw_sigma_rad);
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
  const double path = all.to.path_m - all.from.path_m;
  const double bend = scales.gyro ? 0.0 : scales.turn_share * (all.to.turned_rad - all.from.turned_rad) / 2;
  const double limit = options.contradiction_m + (scales.distance_share + bend) * path +
                       kSigmas * std::max(all.from.position_sigma_m, all.to.position_sigma_m);
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

const char* name_of(MotionSource source) {
  constexpr std::array<const char*, 4> kNames{"commands", "wheels", "gyro", "tags"};
  return kNames[static_cast<std::size_t>(source)];
}

std::string explanation(const Contradiction& found) {
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
  const bool tags = std::ranges::all_of(cuts, [](const Cut& cut) { return cut.from.tags && cut.to.tags; });
  if (!found && tags) found = turns_and_tags(cuts, scales, options);
  if (!found && tags) found = ways_and_tags(cuts, scales, options);
  if (found) found->over_s = over_s;
  return found;
}

std::optional<Contradiction> find_carry(const MotionSample& before, const MotionSample& after, double stood_s,
                                        const ConsistencyOptions& options) {
  if (!before.tags || !after.tags) return std::nullopt;
  const Cut cut{before, after};
  const double way = apart(cut).norm();
  const double turn = std::abs(straight(turned_by_tags(cut) - turned_by_odometry(cut)));
  const bool turning =
      turn > options.contradiction_rad + kSigmas * (before.yaw_sigma_rad + after.yaw_sigma_rad);
  const double limit = options.contradiction_m + kSigmas * (before.position_sigma_m + after.position_sigma_m);
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
    if (!(gap_s > 0 && gap_s < 1)) samples_.clear();  // another clock, or a gap that nobody can bridge
    now_.wheels_m += moved.x();
    now_.wheels_rad += moved.yaw();
    now_.path_m += moved.translation().norm();
    now_.turned_rad += std::abs(moved.yaw());
    const double turn = scales().gyro ? 0.0 : scales().turn_scale * moved.yaw();
    now_.odom_T_base =
        now_.odom_T_base * SE2::exp({distance_scale_ * moved.x(), distance_scale_ * moved.y(), turn});
  }
  odometry_ = odometry;
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
  const double share = actuators_.speed_lag_s > 0 ? 1 - std::exp(-dt_s_ / actuators_.speed_lag_s) : 1;
  now_.ramp_m_s += std::abs(sent.speed_m_s - commanded_m_s_);
  commanded_m_s_ = sent.speed_m_s;
  motor_m_s_ += (sent.speed_m_s - motor_m_s_) * share;
  now_.commanded_m += motor_m_s_ * dt_s_;
}

void MotionConsistency::observe(const SE2& map_T_base, double position_sigma_m, double yaw_sigma_rad,
                                bool tags) {
  now_.map_T_base = map_T_base;
  now_.position_sigma_m = position_sigma_m;
  now_.yaw_sigma_rad = yaw_sigma_rad;
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
  if (!moves) {
    stood_s_ += dt_s_;
    return;
  }
  constexpr double kStood_s = 0.3;
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
  learnt_to_ = gone;
}

MotionScales MotionConsistency::scales() const {
  MotionScales scales;
  scales.gyro = imu_ && odometry_ && std::abs(to_seconds(odometry_->stamp - *imu_)) < kGap_s;
  scales.distance_share += kUnknownWay * kWayPrior / (kWayPrior + way_way_);
  scales.turn_share += kUnknownTurn * kTurnPrior / (kTurnPrior + turn_turn_);
  scales.turn_scale = (turn_true_ + kTurnPrior) / (turn_turn_ + kTurnPrior);
  return scales;
}

std::optional<Contradiction> MotionConsistency::contradiction() const {
  if (carried_) return carried_;
  if (samples_.empty()) return std::nullopt;
  const auto newest = std::ranges::lower_bound(samples_, samples_.back().moving_s - options_.window_s - 1e-9,
                                               {}, &MotionSample::moving_s);
  if (auto found = find_contradiction({newest, samples_.end()}, scales(), options_)) return found;
  ConsistencyOptions longer = options_;
  longer.window_s = std::max(options_.window_s, kLongWindow_s);
  return find_contradiction({samples_.begin(), samples_.end()}, scales(), longer);
}

}  // namespace waymark
