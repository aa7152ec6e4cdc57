#include "waymark/mapping/scene/scene_calibration.hpp"

#include <algorithm>
#include <cmath>

#include "waymark/camera/intrinsics.hpp"
#include "waymark/geometry/lie.hpp"

namespace waymark {

void free_intrinsics(SceneMap& map, bool all) {
  constexpr double kShare = 0.01;
  constexpr double kRadial = 0.05;
  constexpr double kTangential = 0.005;
  Bundle& bundle = map.problem.bundle;
  bundle.intrinsics.clear();
  for (std::size_t c = 0; c < bundle.cameras.size(); ++c) {
    const CameraModel& camera = bundle.cameras[c];
    const Eigen::VectorXd& known = map.scene.cameras[c].intrinsics_sigma;
    BundleIntrinsics free{.prior = intrinsics_of(camera)};
    if (known.size() > 0 || !all) {
      free.sigma = known;
      bundle.intrinsics.push_back(std::move(free));
      continue;
    }
    free.sigma = kShare * free.prior.cwiseAbs();
    free.sigma.segment<2>(2).setConstant(kShare * camera.width_px());
    const std::vector<std::string> names = intrinsics_names(camera);
    for (std::size_t i = 4; i < names.size(); ++i)
      free.sigma[static_cast<Eigen::Index>(i)] = names[i].starts_with('p') ? kTangential : kRadial;
    bundle.intrinsics.push_back(std::move(free));
  }
}

void report_intrinsics(SceneMap& map) {
  const Bundle& bundle = map.problem.bundle;
  for (std::size_t c = 0; c < bundle.intrinsics.size(); ++c) {
    const Eigen::MatrixXd& P = map.covariance.intrinsics[c];
    if (P.size() == 0) continue;  // the camera has no observations in use
    map.intrinsics.push_back({.camera = c,
                              .names = intrinsics_names(bundle.cameras[c]),
                              .given = bundle.intrinsics[c].prior,
                              .prior_sigma = bundle.intrinsics[c].sigma,
                              .found = intrinsics_of(bundle.cameras[c]),
                              .sigma = P.diagonal().cwiseSqrt()});
    map.scene.cameras[c].model = bundle.cameras[c];
  }
}

namespace {

class ScaleSearch {
 public:
  ScaleSearch(SceneMap& map, double prior_sigma, const std::function<void()>& adjust)
      : map_(map), prior_sigma_(prior_sigma), adjust_(adjust) {}

  /// The minimum cost with all tag sizes multiplied by `scale`.
  double cost_at(double scale) {
    Bundle& bundle = map_.problem.bundle;
    const double ratio = scale / map_.size_scale;
    map_.size_scale = scale;
    for (CornerTerm& term : bundle.corners) term.factor.size_m *= ratio;
    for (PointDistanceTerm& term : bundle.point_distances) {
      term.a.tag_p *= ratio;
      term.b.tag_p *= ratio;
    }
    for (PointCoordinateTerm& term : bundle.point_coordinates) term.point.tag_p *= ratio;
    for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
      SE3& pose = bundle.poses[i].value;
      if (!bundle.poses[i].fixed) pose = SE3(pose.rotation(), ratio * pose.translation());
    }
    adjust_();
    const double off = (scale - 1) / prior_sigma_;
    return cost(bundle) + off * off / 2;
  }

  TagScale find(double start) {
    TagScale found;
    cost_at(start);
    for (double step : {prior_sigma_, prior_sigma_ / 10}) {
      const double at = map_.size_scale;
      const double middle = cost_at(at);
      const double less = cost_at(at - step);
      const std::vector<BundlePose> lower = map_.problem.bundle.poses;
      const double more = cost_at(at + step);
      const double bend = less - 2 * middle + more;
      const double best = bend > 0 ? step * (less - more) / (2 * bend) : 0;
      if (step == prior_sigma_) find_uncertainty(lower, step, bend, found);
      cost_at(at + std::clamp(best, -10 * step, 10 * step));
    }
    found.value = map_.size_scale;
    return found;
  }

 private:
  /// The poses must be those at the larger of the two sizes.
  void find_uncertainty(const std::vector<BundlePose>& lower, double step, double bend,
                        TagScale& found) const {
    found.sigma = bend > 0 ? std::min(step / std::sqrt(bend), prior_sigma_) : prior_sigma_;
    const std::vector<BundlePose>& upper = map_.problem.bundle.poses;
    found.by_scale.reserve(upper.size());
    for (std::size_t i = 0; i < upper.size(); ++i)
      found.by_scale.push_back(minus(upper[i].value, lower[i].value) / (2 * step));
  }

  SceneMap& map_;
  double prior_sigma_;
  const std::function<void()>& adjust_;
};

}  // namespace

TagScale find_tag_scale(SceneMap& map, double start, double prior_sigma,
                        const std::function<void()>& adjust) {
  return ScaleSearch(map, prior_sigma, adjust).find(start);
}

}  // namespace waymark
