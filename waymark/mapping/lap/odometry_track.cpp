#include "waymark/mapping/lap/odometry_track.hpp"

#include <algorithm>
#include <cmath>

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
