#include "waymark/replay/picture_delay.hpp"

#include <algorithm>
#include <cmath>

namespace waymark {
namespace {

/// Sums of a line y = a + s x.
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

std::optional<Fit> fit(std::span<const HeadingAt> pictures, std::span<const HeadingAt> odometry,
                       double delay_s, double most_s) {
  LineSums sums;
  for (const HeadingAt& seen : pictures) {
    if (!heading_at(odometry, seen.time_s - most_s)) continue;  // the same pictures for all delays
    const auto turned = heading_at(odometry, seen.time_s - delay_s);
    if (!turned) continue;
    const double x = *turned - odometry.front().yaw_rad;
    const double y = seen.yaw_rad - pictures.front().yaw_rad;
    sums.n += 1;
    sums.x += x;
    sums.y += y;
    sums.xx += x * x;
    sums.xy += x * y;
    sums.yy += y * y;
  }
  constexpr double kFewest = 30;
  if (sums.n < kFewest) return std::nullopt;
  const double xx = sums.xx - sums.x * sums.x / sums.n;
  const double xy = sums.xy - sums.x * sums.y / sums.n;
  const double yy = sums.yy - sums.y * sums.y / sums.n;
  constexpr double kTurned_rad = 0.1;
  if (xx < sums.n * kTurned_rad * kTurned_rad) return std::nullopt;
  return Fit{xy / xx, std::sqrt(std::max(0.0, yy - xy * xy / xx) / sums.n)};
}

}  // namespace

std::optional<PictureDelay> find_delay(std::span<const HeadingAt> pictures,
                                       std::span<const HeadingAt> odometry, double most_s) {
  constexpr double kStep_s = 0.02;
  constexpr double kLeastScale = 0.15;
  constexpr double kTelling_rad = 0.03;  // what a delay must explain
  constexpr double kBetter = 3;
  const auto undelayed = fit(pictures, odometry, 0, most_s);
  if (!undelayed || undelayed->rms_rad < kTelling_rad) return std::nullopt;
  PictureDelay best{.rms_rad = undelayed->rms_rad, .rms_undelayed_rad = undelayed->rms_rad};
  double scale = undelayed->scale;
  for (double delay_s = kStep_s; delay_s < most_s; delay_s += kStep_s) {
    const auto found = fit(pictures, odometry, delay_s, most_s);
    if (!found || found->rms_rad >= best.rms_rad) continue;
    best.delay_s = delay_s;
    best.rms_rad = found->rms_rad;
    scale = found->scale;
  }
  const bool ends = best.delay_s + 2 * kStep_s > most_s;  // a longer one may fit better yet
  if (ends || scale < kLeastScale || kBetter * best.rms_rad > best.rms_undelayed_rad) return std::nullopt;
  return best;
}

}  // namespace waymark
