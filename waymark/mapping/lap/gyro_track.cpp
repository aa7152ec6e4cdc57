#include "waymark/mapping/lap/gyro_track.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

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
