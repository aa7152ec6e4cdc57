#include "waymark/localization/sudden_halt.hpp"

namespace waymark {
namespace {

constexpr double kHaltWay_m = 1e-7;
constexpr double kHardestStop_m_s2 = 8;  // tyres slip at less
constexpr double kHaltSlow_m_s = 0.1;    // coarse encoders seem to stop between their ticks
constexpr double kHaltMoment_s = 0.05;   // the noise of tags hides what a robot goes in less
constexpr double kHaltStands = 0.3;      // corrected by less than this share of the way that was feared

}  // namespace

MotionStep SuddenHalt::advance(MotionStep step) {
  const double way_m = step.twist.head<2>().norm();
  if (step.dt_s <= 0) return step;
  if (way_m > kHaltWay_m || step.jumped) {
    *this = {};
    speed_m_s_ = way_m / step.dt_s;
    yaw_rate_rad_s_ = step.twist.z() / step.dt_s;
    return step;
  }
  const double period_s = step.dt_s / step.share;
  doubted_ = doubted_ || (speed_m_s_ > kHaltSlow_m_s && speed_m_s_ > kHardestStop_m_s2 * period_s);
  if (!doubted_) {
    speed_m_s_ = 0;
    return step;
  }
  const double before_s = since_s_;
  since_s_ += step.dt_s;
  const double grown_s2 = since_s_ * since_s_ - before_s * before_s;
  step.extra_m2 += speed_m_s_ * speed_m_s_ * grown_s2;
  if (step.twist.z() == 0) step.extra_rad2 += yaw_rate_rad_s_ * yaw_rate_rad_s_ * grown_s2;
  step.standing = false;
  return step;
}

void SuddenHalt::observe_correction(double moved_m) {
  if (!doubted_) return;
  const bool stands = since_s_ > kHaltMoment_s && moved_m < kHaltStands * speed_m_s_ * since_s_;
  if (stands) *this = {};
  since_s_ = 0;
}

}  // namespace waymark
