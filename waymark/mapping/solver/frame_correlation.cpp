#include "waymark/mapping/solver/frame_correlation.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace waymark {
namespace {

using Residual = Eigen::Matrix<double, 8, 1>;
using Series = std::map<std::size_t, Residual>;  ///< by frame

using AllSeries = std::map<std::pair<std::size_t, PoseIndex>, Series>;

/// The residuals in use, one series for each camera and tag.
AllSeries residuals_in_use(const Bundle& bundle, const std::vector<std::size_t>& frames) {
  AllSeries all;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const CornerTerm& term = bundle.corners[i];
    if (!term.used) continue;
    const auto r = corner_residual(term.factor, bundle.cameras[term.camera],
                                   {bundle.poses[term.rig].value, bundle.poses[term.cam].value,
                                    bundle.poses[term.body].value, bundle.poses[term.tag].value});
    if (r) all[{term.camera, term.tag}].emplace(frames[i], *r);
  }
  return all;
}

/// The mean product of residuals so many frames apart; 0 where there are none.
double correlation(const AllSeries& all, std::size_t lag) {
  double product = 0;
  std::size_t pairs = 0;
  for (const auto& [key, series] : all) {
    for (const auto& [frame, r] : series) {
      const auto later = series.find(frame + lag);
      if (later == series.end()) continue;
      product += r.dot(later->second);
      ++pairs;
    }
  }
  return pairs == 0 ? 0 : product / static_cast<double>(pairs);
}

}  // namespace

double correlated_frames(const Bundle& bundle, const std::vector<std::size_t>& frames) {
  const auto all = residuals_in_use(bundle, frames);
  double square = 0;
  std::size_t count = 0;
  std::size_t longest = 0;
  for (const auto& [key, series] : all) {
    for (const auto& [frame, r] : series) square += r.squaredNorm();
    count += series.size();
    longest = std::max(longest, series.size());
  }
  if (count == 0 || !(square > 0)) return 1;
  square /= static_cast<double>(count);
  double factor = -1;
  for (std::size_t lag = 0; lag < longest; lag += 2) {
    const double pair = correlation(all, lag) + correlation(all, lag + 1);
    if (!(pair > 0)) break;
    factor += 2 * pair / square * (1 - (static_cast<double>(lag) + 0.5) / static_cast<double>(longest));
  }
  return std::clamp(factor, 1.0, static_cast<double>(longest));
}

}  // namespace waymark
