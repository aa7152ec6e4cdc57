#include "waymark/evaluation/matching.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

/// Who is still free on both sides.
struct Free {
  std::vector<bool> detections;
  std::vector<bool> truth;
};

/// Greedy assignment: the nearest pair first. `distance(d, t)` gives a negative number for a pair that may
/// not match.
template <class Distance>
std::vector<MatchedPair> take_nearest(Free& free, Distance&& distance) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;
  for (std::size_t d = 0; d < free.detections.size(); ++d) {
    for (std::size_t t = 0; t < free.truth.size(); ++t) {
      if (!free.detections[d] || !free.truth[t]) continue;
      if (const double px = distance(d, t); px >= 0) pairs.emplace_back(px, d, t);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<MatchedPair> taken;
  for (const auto& [px, d, t] : pairs) {
    if (!free.detections[d] || !free.truth[t]) continue;
    free.detections[d] = false;
    free.truth[t] = false;
    taken.push_back({d, t});
  }
  return taken;
}

double limit_px(const TrueTag& truth, const MatchOptions& options) {
  return std::max(options.match_distance_px, options.match_distance_sides * mean_side_px(truth.corners_px));
}

}  // namespace

double corner_distance_px(const std::array<Eigen::Vector2d, 4>& detected,
                          const std::array<Eigen::Vector2d, 4>& truth, std::size_t quarter_turns) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum += (detected[(i + quarter_turns) % 4] - truth[i]).squaredNorm();
  return std::sqrt(sum / 4);
}

Matching match_detections(std::span<const TagDetection> detections, std::span<const TrueTag> truth,
                          const MatchOptions& options) {
  Free free{std::vector<bool>(detections.size(), true), std::vector<bool>(truth.size(), true)};
  Matching matching;
  matching.correct = take_nearest(free, [&](std::size_t d, std::size_t t) {
    if (detections[d].tag != truth[t].tag) return -1.0;
    const double px = corner_distance_px(detections[d].corners_px, truth[t].corners_px);
    return px <= limit_px(truth[t], options) ? px : -1.0;
  });
  for (std::size_t t = 0; t < truth.size(); ++t) {
    if (free.truth[t]) matching.missed.push_back(t);
  }
  matching.wrong_id = take_nearest(free, [&](std::size_t d, std::size_t t) {
    double px = corner_distance_px(detections[d].corners_px, truth[t].corners_px);
    for (std::size_t turns = 1; turns < 4; ++turns) {
      px = std::min(px, corner_distance_px(detections[d].corners_px, truth[t].corners_px, turns));
    }
    return px <= limit_px(truth[t], options) ? px : -1.0;
  });
  for (std::size_t d = 0; d < detections.size(); ++d) {
    if (free.detections[d]) matching.false_positives.push_back(d);
  }
  return matching;
}

}  // namespace waymark
