#include "waymark/localization/timeline.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "waymark/geometry/lie.hpp"
#include "waymark/samples/odometry_jump.hpp"

namespace waymark {
namespace {

constexpr double kMaxGyroGap_s = 0.25;  // time without a reading after which the wheels are used
constexpr double kStandstillAfter_s = 0.3;

}  // namespace

MotionStep MotionSegment::part(SensorTime begin, SensorTime end) const {
  const double whole = to_seconds(to - from);
  const double share = whole > 0 ? to_seconds(end - begin) / whole : 0;
  MotionStep piece = step;
  piece.twist *= share;
  piece.dt_s *= share;
  piece.yaw_disagreement_rad *= std::sqrt(share);  // because its square is a variance
  piece.extra_m2 *= share;
  piece.extra_rad2 *= share;
  piece.share = share;
  piece.continues = begin > from;
  return piece;
}

MotionInput::MotionInput(const RiekfOptions& options)
    : use_gyro_(options.rotation != "odometry"),
      bias_sigma_rad_s_(options.motion.yaw_bias_sigma_rad_s),
      wheel_yaw_rad_sqrt_m_(options.motion.wheel_yaw_rad_sqrt_m),
      odometry_scale_(options.odometry_scale),
      yaw_scale_(options.yaw_scale),
      gyro_gain_(options.gyro_gain),
      gyro_bias_rad_s_(options.gyro_bias_rad_s) {}

void MotionInput::add(const ImuSample& imu) {
  const double rate = gyro_gain_ * (imu.angular_velocity_rad_s.z() - gyro_bias_rad_s_);
  if (!std::isfinite(rate)) {
    ++not_finite_;
    return;
  }
  Turned next{.stamp = imu.stamp, .angle_rad = 0, .rate_rad_s = rate};
  if (turned_count_ > 0) {
    const Turned& last = turned_[(turned_count_ - 1) % kKept];
    if (imu.stamp <= last.stamp) {
      ++not_forwards_;
      return;
    }
    const double dt_s = to_seconds(imu.stamp - last.stamp);
    next.angle_rad = last.angle_rad + dt_s * (last.rate_rad_s + rate) / 2;
  }
  turned_[turned_count_++ % kKept] = next;
}

std::optional<double> MotionInput::gyro_angle(SensorTime stamp) const {
  if (!use_gyro_ || turned_count_ == 0) return std::nullopt;
  const Turned& newest = turned_[(turned_count_ - 1) % kKept];
  if (stamp >= newest.stamp) {
    const double ahead_s = to_seconds(stamp - newest.stamp);
    if (ahead_s > kMaxGyroGap_s) return std::nullopt;
    return newest.angle_rad + ahead_s * newest.rate_rad_s;
  }
  const std::size_t kept = std::min(turned_count_, kKept);
  for (std::size_t back = 1; back < kept; ++back) {
    const Turned& a = turned_[(turned_count_ - 1 - back) % kKept];
    const Turned& b = turned_[(turned_count_ - back) % kKept];
    if (a.stamp > stamp) continue;
    const double gap_s = to_seconds(b.stamp - a.stamp);
    if (gap_s > kMaxGyroGap_s) return std::nullopt;
    const double s = to_seconds(stamp - a.stamp);
    return a.angle_rad + s * (a.rate_rad_s + (b.rate_rad_s - a.rate_rad_s) * s / (2 * gap_s));
  }
  return std::nullopt;
}

/// Difference between the turns from gyro and wheels over the last few moments. Their stamps differ slightly,
/// so individual steps always disagree; turns from wheels are routinely wrong by a seventh.
double MotionInput::disagreement(double wheel_turn_rad, const MotionStep& step) {
  constexpr double kMoment = 0.3;
  const double kept = std::exp(-step.dt_s / kMoment);
  gyro_rate_ = kept * gyro_rate_ + (1 - kept) * step.twist.z() / step.dt_s;
  wheel_rate_ = kept * wheel_rate_ + (1 - kept) * wheel_turn_rad / step.dt_s;
  const double apart =
      std::abs(gyro_rate_ - wheel_rate_) - 0.15 * std::abs(wheel_rate_) - 3 * bias_sigma_rad_s_;
  constexpr double kNoise = 0.03;  // in rad/s
  return std::max(0.0, apart - kNoise) * std::sqrt(kMoment * step.dt_s);
}

/// Whether the robot is at standstill. Odometry then reports either no motion at all, or exactly the same
/// slow motion repeatedly, which is a velocity offset. A reading that is repeated to the last digit does not
/// measure motion.
bool MotionInput::is_standstill(const MotionStep& step, double wheel_turn_rad) const {
  constexpr double kStill = 1e-7;
  constexpr double kCreeping = 0.03;  // in m/s
  constexpr double kTurning = 0.02;   // in rad/s
  const double slowest = std::max(3 * bias_sigma_rad_s_, 1e-6) * step.dt_s;
  const bool no_translation = step.twist.head<2>().norm() < kStill && std::abs(wheel_turn_rad) < slowest &&
                              std::abs(step.twist.z()) < slowest;
  if (no_translation || last_step_.dt_s <= 0) return no_translation;
  const double other = std::abs(step.twist.x() / step.dt_s - last_step_.twist.x() / last_step_.dt_s);
  return other < kStill && std::abs(step.twist.x()) < kCreeping * step.dt_s &&
         std::abs(step.twist.z()) < kTurning * step.dt_s;
}

MotionStep MotionInput::step_of(const Odometry& a, const Odometry& b) {
  MotionStep step{.dt_s = to_seconds(b.stamp - a.stamp)};
  step.twist = (a.odom_T_base.inverse() * b.odom_T_base).log();
  step.twist.head<2>() *= odometry_scale_;
  step.twist.z() *= yaw_scale_;
  const auto turned_a = gyro_angle(a.stamp);
  const auto turned_b = gyro_angle(b.stamp);
  const double wheel_turn = step.twist.z();
  if (turned_a && turned_b) {
    step.twist.z() = *turned_b - *turned_a;
    step.yaw_disagreement_rad = disagreement(wheel_turn, step);
  } else {
    step.extra_rad2 = wheel_yaw_rad_sqrt_m_ * wheel_yaw_rad_sqrt_m_ * step.twist.head<2>().norm();
  }
  const bool still = is_standstill(step, wheel_turn);
  standstill_s_ = still ? standstill_s_ + step.dt_s : 0;
  step.standing = standstill_s_ > kStandstillAfter_s;
  return step;
}

/// Whether odometry jumped because a counter was reset or another drive began. The limits exceed the speed of
/// any robot that repeats routes.
bool MotionInput::impossible(const MotionStep& step) {
  constexpr double kGap = 5;  // [s] time without odometry after which the motion is unknown
  return faster_than_any_robot(step.twist.head<2>().norm(), step.twist.z(), step.dt_s) || step.dt_s > kGap;
}

std::optional<MotionSegment> MotionInput::add(const Odometry& odometry) {
  if (!odometry.odom_T_base.matrix().allFinite()) {
    ++not_finite_;
    return std::nullopt;
  }
  if (!last_) {
    last_ = odometry;
    return std::nullopt;
  }
  if (odometry.stamp <= last_->stamp) {
    ++not_forwards_;
    return std::nullopt;
  }
  MotionSegment segment{last_->stamp, odometry.stamp, step_of(*last_, odometry)};
  if (impossible(segment.step)) {
    ++jumps_;
    segment.step = {.dt_s = segment.step.dt_s, .jumped = true};
  }
  last_ = odometry;
  last_step_ = segment.step;
  return segment;
}

MotionSegment MotionInput::guess(SensorTime from, SensorTime to) const {
  constexpr double kSpeed = 0.3;  // [m/s] possible change in speed during this time
  constexpr double kTurn = 0.5;   // in rad/s
  const double dt_s = to_seconds(to - from);
  MotionStep step{
      .dt_s = dt_s, .extra_m2 = kSpeed * kSpeed * dt_s * dt_s, .extra_rad2 = kTurn * kTurn * dt_s * dt_s};
  if (last_step_.dt_s > 0) step.twist = last_step_.twist * (dt_s / last_step_.dt_s);
  return {from, to, step};
}

Timeline::Timeline(std::size_t segments, std::size_t frames)
    : segments_(segments), frames_(frames), order_(frames) {
  std::iota(order_.begin(), order_.end(), 0U);
}

void Timeline::add(const MotionSegment& segment) {
  if (segment_count_ == segments_.size()) {
    first_segment_ = (first_segment_ + 1) % segments_.size();
    --segment_count_;
  }
  segments_[(first_segment_ + segment_count_) % segments_.size()] = segment;
  ++segment_count_;
  covered_ = segment.to;
}

FrameObservations& Timeline::add_frame(SensorTime stamp) {
  if (order_count_ == order_.size()) {
    std::rotate(order_.begin(), order_.begin() + 1, order_.end());
    --order_count_;
  }
  const std::uint32_t slot = order_[order_count_];
  std::size_t at = order_count_;
  while (at > 0 && frames_[order_[at - 1]].stamp > stamp) --at;
  const auto place = order_.begin() + static_cast<std::ptrdiff_t>(at);
  std::rotate(place, order_.begin() + static_cast<std::ptrdiff_t>(order_count_),
              order_.begin() + static_cast<std::ptrdiff_t>(order_count_) + 1);
  ++order_count_;
  FrameObservations& frame = frames_[slot];
  frame.stamp = stamp;
  frame.number = numbers_++;
  frame.sealed = true;
  frame.reported = false;
  frame.count = 0;
  return frame;
}

SensorTime Timeline::begin() const { return segment_count_ == 0 ? covered_ : segment(0).from; }

void Timeline::forget_before(SensorTime stamp) {
  while (segment_count_ > 0 && segment(0).to < stamp) {
    first_segment_ = (first_segment_ + 1) % segments_.size();
    --segment_count_;
  }
  std::size_t old = 0;
  while (old < order_count_ && frames_[order_[old]].stamp < stamp) ++old;
  std::rotate(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(old),
              order_.begin() + static_cast<std::ptrdiff_t>(order_count_));
  order_count_ -= old;
}

}  // namespace waymark
