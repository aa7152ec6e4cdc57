#include "waymark/replay/motion_sums.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace waymark {
namespace {

/// Way [m^2] and turns [rad^2] that the first belief in a scale is worth.
constexpr double kWayPrior = 0.25;
constexpr double kTurnPrior = 0.05;
constexpr double kForget_m = 8;
/// Share of the commanded turn that an unknown robot turns, and how uncertain that is.
constexpr double kCommandGain = 0.7;
constexpr double kUnknownCommand = 0.6;
constexpr Duration kHistory = std::chrono::seconds(10);

}  // namespace

OdometryPrior odometry_prior(const Calibration& calibration) {
  constexpr double kWithin = 3;         // standard deviations
  constexpr double kLeastShare = 0.02;  // the way is another, and so is the load
  OdometryPrior prior;
  const auto take = [&](const char* name, double& scale, double& share) {
    const auto known = calibration.known(name);
    if (!known || !(*known > 0)) return;
    scale = *known;
    share = std::min(share, std::max(kLeastShare, kWithin * calibration.values.at(name).sigma / *known));
  };
  take("odometry_scale", prior.distance_scale, prior.distance_share);
  take("yaw_gain", prior.turn_scale, prior.turn_share);
  prior.turn_noise_sqrt_m = calibration.known("yaw_noise_rad_sqrt_m").value_or(0);
  return prior;
}

bool MotionSums::add(const Odometry& odometry) {
  bool follows = true;
  if (odometry_) {
    const SE2 moved = odometry_->odom_T_base.inverse() * odometry.odom_T_base;
    const double gap_s = to_seconds(odometry.stamp - odometry_->stamp);
    if (!(gap_s > 0 && gap_s < 1)) {  // another clock, or a gap that nobody can bridge
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
  constexpr int kFewest = 10;
  constexpr double kOtherwise_rad_s = 0.1;
  const bool otherwise = now_.ramp_rad_s - ramp_before_ > kOtherwise_rad_s;
  return imu_ && otherwise && repeats_ >= kFewest ? to_seconds(*imu_ - repeated_.stamp) : 0;
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

/// Standing adds nothing: the sample before it stays the newest, so that the next motion is held against it.
Standing MotionSums::keep() {
  constexpr double kCreep_m_s = 0.01;
  constexpr double kCreep_rad_s = 0.05;
  if (samples_.empty()) {
    learnt_to_.reset();
    samples_.push_back(now_);
    return {};
  }
  const MotionSample& last = samples_.back();
  constexpr double kStood_s = 0.3;
  // A tick of an encoder does not end a standstill: a carry would be cut in two, and each part pass for
  // noise.
  constexpr double kMoved_m = 0.005;
  constexpr double kMoved_rad = 0.05;
  const SE2 since = last.odom_T_base.inverse() * now_.odom_T_base;
  const bool creeps = stood_s_ > kStood_s
                          ? since.translation().norm() > kMoved_m || std::abs(since.yaw()) > kMoved_rad
                          : std::abs(now_.path_m - last.path_m) > kCreep_m_s * dt_s_ ||
                                std::abs(now_.turned_rad - last.turned_rad) > kCreep_rad_s * dt_s_;
  if (!creeps && std::abs(motor_m_s_) <= kCreep_m_s) {
    stood_s_ += dt_s_;
    return {.stands = stood_s_ > kStood_s};
  }
  Standing standing;
  if (stood_s_ > kStood_s) standing.over = {last, now_, stood_s_};
  stood_s_ = 0;
  now_.moving_s += dt_s_;
  samples_.push_back(now_);
  while (samples_.size() > 2 && samples_[1].moving_s <= now_.moving_s - kept_s_) {
    learn(samples_.front());
    samples_.pop_front();
  }
  return standing;
}

/// From the motion that has left the window, half a metre at a time.
void MotionSums::learn(const MotionSample& gone) {
  constexpr double kStep_m = 0.3;
  constexpr double kStep_rad = 0.3;
  if (!gone.tags) return learnt_to_.reset();
  if (!learnt_to_) {
    learnt_to_ = gone;
    return;
  }
  const internal::Cut cut{*learnt_to_, gone};
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
  const double truly = scales().gyro ? cut.to.gyro_rad - cut.from.gyro_rad : internal::turned_by_tags(cut);
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
  stood_s_ = 0;
}

}  // namespace waymark
