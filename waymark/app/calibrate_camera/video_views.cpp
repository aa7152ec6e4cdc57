#include "waymark/app/calibrate_camera/video_views.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace waymark {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

/// The slower of the motions to the picture before and after would hide a start or a stop: the faster counts.
std::vector<double> speeds_px_s(const std::vector<StampedMarks>& pictures) {
  std::vector<double> speeds(pictures.size(), 0);
  for (std::size_t i = 1; i < pictures.size(); ++i) {
    const double dt_s = std::max(to_seconds(pictures[i].stamp - pictures[i - 1].stamp), 1e-6);
    const double apart = apart_px(pictures[i - 1].marks, pictures[i].marks);
    const double speed = std::isfinite(apart) ? apart / dt_s : kFar;
    speeds[i] = std::max(speeds[i], speed);
    speeds[i - 1] = std::max(speeds[i - 1], speed);
  }
  return speeds;
}

/// Of those that are chosen, the one nearest to another goes, until few enough are left.
void thin_out(std::vector<std::size_t>& chosen, const std::vector<StampedMarks>& pictures, std::size_t most) {
  while (chosen.size() > most) {
    std::size_t superfluous = 0;
    double nearest = kFar;
    for (std::size_t i = 1; i < chosen.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const double apart = apart_px(pictures[chosen[i]].marks, pictures[chosen[j]].marks);
        if (apart >= nearest) continue;
        nearest = apart;
        superfluous = i;
      }
    }
    chosen.erase(chosen.begin() +
                 static_cast<std::ptrdiff_t>(superfluous == 0 ? chosen.size() - 1 : superfluous));
  }
}

std::size_t points_of(const TargetPicture& marks) {
  std::size_t points = 0;
  for (const TargetMark& mark : marks) points += mark.seen_px.size();
  return points;
}

}  // namespace

std::vector<std::size_t> choose_views(const std::vector<StampedMarks>& pictures, double diagonal_px,
                                      const VideoViewOptions& options) {
  const std::vector<double> speeds = speeds_px_s(pictures);
  const std::size_t fewest = 4 * static_cast<std::size_t>(options.fewest_tags);
  std::vector<std::size_t> by_speed;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (points_of(pictures[i].marks) >= fewest && speeds[i] <= options.fastest_px_s) by_speed.push_back(i);
  }
  std::ranges::stable_sort(by_speed, {}, [&](std::size_t i) { return speeds[i]; });
  std::vector<std::size_t> chosen;
  for (const std::size_t i : by_speed) {
    const bool is_new = std::ranges::all_of(chosen, [&](std::size_t c) {
      return apart_px(pictures[c].marks, pictures[i].marks) > options.new_view_share * diagonal_px;
    });
    if (is_new) chosen.push_back(i);
  }
  std::ranges::sort(chosen);
  thin_out(chosen, pictures, static_cast<std::size_t>(options.most_views));
  return chosen;
}

}  // namespace waymark
