#include "waymark/evaluation/turn_response.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

#include "waymark/base/angles.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/evaluation/pose_pairs.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

constexpr Duration kMostGap = std::chrono::milliseconds(500);

/// Integral of the commanded yaw rate between two moments; each command holds until the next.
double commanded_rad(const std::vector<StampedCommand>& commands, std::size_t& at, SensorTime from,
                     SensorTime to) {
  while (at + 1 < commands.size() && commands[at + 1].stamp <= from) ++at;
  double turned_rad = 0;
  for (std::size_t i = at; i < commands.size() && commands[i].stamp < to; ++i) {
    const SensorTime begins = std::max(commands[i].stamp, from);
    const SensorTime ends = i + 1 < commands.size() ? std::min(commands[i + 1].stamp, to) : to;
    turned_rad += commands[i].command.yaw_rate_rad_s * to_seconds(ends - begins);
  }
  return turned_rad;
}

}  // namespace

std::optional<double> turn_response(const std::vector<StampedCommand>& commands, const Trajectory& trajectory,
                                    double delay_s) {
  constexpr Duration kWindow = std::chrono::milliseconds(500);
  constexpr int kFewest = 20;
  const double least_rad = to_radians(2);
  if (commands.empty() || trajectory.empty()) return std::nullopt;
  const auto delay = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(delay_s));
  std::size_t at = 0;
  double product = 0;
  double square = 0;
  int windows = 0;
  for (SensorTime from = std::max(trajectory.front().stamp, commands.front().stamp + delay);
       from + kWindow <= trajectory.back().stamp; from += kWindow) {
    const double asked_rad = commanded_rad(commands, at, from - delay, from + kWindow - delay);
    const auto begin = pose_at(trajectory, from, kMostGap);
    const auto end = pose_at(trajectory, from + kWindow, kMostGap);
    if (!begin || !end) continue;
    product += asked_rad * project_to_plane(begin->inverse() * *end).yaw();
    square += asked_rad * asked_rad;
    windows += std::abs(asked_rad) >= least_rad ? 1 : 0;
  }
  return windows < kFewest ? std::nullopt : std::optional(product / square);
}

std::optional<double> observation_distance_m(const std::vector<TagFrame>& frames, const TagMap& map,
                                             const SE3& base_T_cam, const Trajectory& trajectory,
                                             double share) {
  constexpr std::size_t kFewest = 50;
  std::vector<double> distances_m;
  for (const TagFrame& frame : frames) {
    const auto map_T_base = pose_at(trajectory, frame.stamp, kMostGap);
    if (!map_T_base) continue;
    const Eigen::Vector3d eye = (*map_T_base * base_T_cam).translation();
    for (const TagDetection& seen : frame.detections) {
      const MappedTag* tag = map.find(seen.tag);
      if (tag != nullptr) distances_m.push_back((tag->map_T_tag.translation() - eye).norm());
    }
  }
  if (distances_m.size() < kFewest) return std::nullopt;
  return quantile(std::move(distances_m), share);
}

}  // namespace waymark
