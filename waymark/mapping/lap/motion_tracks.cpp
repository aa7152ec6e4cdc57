#include "waymark/mapping/lap/motion_tracks.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "waymark/geometry/lie.hpp"

namespace waymark {

OdometryTrack::OdometryTrack(const std::vector<Odometry>& odometry) {
  for (const Odometry& sample : odometry) {
    const bool finite = std::isfinite(sample.odom_T_base.x()) && std::isfinite(sample.odom_T_base.y()) &&
                        std::isfinite(sample.odom_T_base.yaw());
    if (finite && (samples_.empty() || sample.stamp > samples_.back().stamp)) {
      samples_.push_back(sample);
    } else {
      ++left_out_;
    }
  }
}

std::optional<SE2> OdometryTrack::at(SensorTime stamp, Duration max_gap) const {
  const auto after = std::ranges::lower_bound(samples_, stamp, {}, &Odometry::stamp);
  if (after == samples_.end()) return std::nullopt;
  if (after->stamp == stamp) return after->odom_T_base;
  if (after == samples_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  if (after->stamp - before->stamp > max_gap) return std::nullopt;
  const double share = to_seconds(stamp - before->stamp) / to_seconds(after->stamp - before->stamp);
  return interpolate(before->odom_T_base, after->odom_T_base, share);
}

std::optional<SE2::Tangent> OdometryTrack::rate_at(SensorTime stamp, Duration window) const {
  const auto before = at(stamp - window / 2);
  const auto after = at(stamp + window / 2);
  if (!before || !after) return std::nullopt;
  return SE2::Tangent((before->inverse() * *after).log() / to_seconds(window));
}

}  // namespace waymark

namespace waymark::internal {
namespace {

constexpr double kGap_s = 0.2;

}  // namespace

GyroTrack::GyroTrack(const std::vector<ImuSample>& samples) {
  for (const ImuSample& sample : samples) {
    Moment next{.stamp = sample.stamp, .rate = sample.angular_velocity_rad_s.z()};
    if (!std::isfinite(next.rate) || (!track_.empty() && sample.stamp <= track_.back().stamp)) continue;
    if (!track_.empty()) {
      const Moment& before = track_.back();
      const double lasts_s = to_seconds(next.stamp - before.stamp);
      const bool gap = lasts_s > kGap_s;
      next.angle_rad = before.angle_rad + (gap ? 0 : (before.rate + next.rate) / 2 * lasts_s);
      next.gaps = before.gaps + (gap ? 1 : 0);
    }
    track_.push_back(next);
  }
}

std::optional<double> GyroTrack::turn(SensorTime from, SensorTime to) const {
  const auto a = at(from);
  const auto b = at(to);
  if (!a || !b || a->gaps != b->gaps) return std::nullopt;
  return b->angle_rad - a->angle_rad;
}

std::optional<GyroTrack::Moment> GyroTrack::at(SensorTime stamp) const {
  const auto after = std::ranges::lower_bound(track_, stamp, {}, &Moment::stamp);
  if (after == track_.end()) return std::nullopt;
  if (after->stamp == stamp) return *after;
  if (after == track_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  if (after->gaps != before->gaps) return std::nullopt;
  Moment between = *before;
  const double share = to_seconds(stamp - before->stamp) / to_seconds(after->stamp - before->stamp);
  between.stamp = stamp;
  between.angle_rad = std::lerp(before->angle_rad, after->angle_rad, share);
  return between;
}

}  // namespace waymark::internal
