#include "waymark/jobs/video_views.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace waymark {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;
using View = std::map<TagId, Corners>;

constexpr double kFar = std::numeric_limits<double>::infinity();

View view_of(const std::vector<TagDetection>& detections) {
  View view;
  for (const TagDetection& detection : detections) view.emplace(detection.tag, detection.corners_px);
  return view;
}

/// The mean distance of the corners that both have; infinite where they share less than half of their tags.
double apart_px(const View& a, const View& b) {
  double sum = 0;
  std::size_t shared = 0;
  for (const auto& [tag, corners] : a) {
    const auto other = b.find(tag);
    if (other == b.end()) continue;
    for (std::size_t k = 0; k < 4; ++k) sum += (corners[k] - other->second[k]).norm();
    ++shared;
  }
  if (shared == 0 || 2 * shared < std::min(a.size(), b.size())) return kFar;
  return sum / (4.0 * static_cast<double>(shared));
}

/// The slower of the motions to the picture before and after would hide a start or a stop: the faster counts.
std::vector<double> speeds_px_s(const std::vector<StampedTags>& pictures, const std::vector<View>& views) {
  std::vector<double> speeds(pictures.size(), 0);
  for (std::size_t i = 1; i < pictures.size(); ++i) {
    const double dt_s = std::max(to_seconds(pictures[i].stamp - pictures[i - 1].stamp), 1e-6);
    const double apart = apart_px(views[i - 1], views[i]);
    const double speed = std::isfinite(apart) ? apart / dt_s : kFar;
    speeds[i] = std::max(speeds[i], speed);
    speeds[i - 1] = std::max(speeds[i - 1], speed);
  }
  return speeds;
}

/// Of those that are chosen, the one nearest to another goes, until few enough are left.
void thin_out(std::vector<std::size_t>& chosen, const std::vector<View>& views, std::size_t most) {
  while (chosen.size() > most) {
    std::size_t superfluous = 0;
    double nearest = kFar;
    for (std::size_t i = 1; i < chosen.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const double apart = apart_px(views[chosen[i]], views[chosen[j]]);
        if (apart >= nearest) continue;
        nearest = apart;
        superfluous = i;
      }
    }
    chosen.erase(chosen.begin() +
                 static_cast<std::ptrdiff_t>(superfluous == 0 ? chosen.size() - 1 : superfluous));
  }
}

}  // namespace

std::vector<std::size_t> choose_views(const std::vector<StampedTags>& pictures, double diagonal_px,
                                      const VideoViewOptions& options) {
  std::vector<View> views;
  views.reserve(pictures.size());
  for (const StampedTags& picture : pictures) views.push_back(view_of(picture.detections));
  const std::vector<double> speeds = speeds_px_s(pictures, views);
  std::vector<std::size_t> by_speed;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (views[i].size() >= static_cast<std::size_t>(options.fewest_tags) && speeds[i] <= options.fastest_px_s)
      by_speed.push_back(i);
  }
  std::ranges::stable_sort(by_speed, {}, [&](std::size_t i) { return speeds[i]; });
  std::vector<std::size_t> chosen;
  for (const std::size_t i : by_speed) {
    const bool is_new = std::ranges::all_of(chosen, [&](std::size_t c) {
      return apart_px(views[c], views[i]) > options.new_view_share * diagonal_px;
    });
    if (is_new) chosen.push_back(i);
  }
  std::ranges::sort(chosen);
  thin_out(chosen, views, static_cast<std::size_t>(options.most_views));
  return chosen;
}

}  // namespace waymark
