#include "waymark/mapping/scene/corner_consistency.hpp"

#include <map>
#include <set>
#include <utility>

namespace waymark {

double corner_chi2_per_dof(const SceneMap& map) {
  const Bundle& bundle = map.problem.bundle;
  std::map<std::pair<std::size_t, std::size_t>, std::pair<double, int>> views;
  std::set<PoseIndex> tags;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    const CornerTerm& term = bundle.corners[i];
    CornerFactor own = term.factor;
    own.whitening = map.observations.seen[i].factor.whitening;
    own.isotropic = map.observations.seen[i].factor.isotropic;
    if (!term.used || own.isotropic) continue;
    const auto r = corner_residual(own, bundle.cameras[term.camera],
                                   {bundle.poses[term.rig].value, bundle.poses[term.cam].value,
                                    bundle.poses[term.body].value, bundle.poses[term.tag].value});
    if (!r) continue;
    auto& [sum, count] = views[{term.camera, map.observations.seen[i].frame}];
    sum += r->squaredNorm();
    ++count;
    tags.insert(term.tag);
  }
  double sum = 0;
  double freedom = -6.0 * static_cast<double>(tags.size());
  for (const auto& [key, view] : views) {
    if (view.second < 2) continue;
    sum += view.first;
    freedom += 8 * view.second - 6;
  }
  return freedom > 0 ? sum / freedom : 0;
}

}  // namespace waymark
