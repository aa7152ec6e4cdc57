#include "waymark/mapping/scene/scene_calibration.hpp"

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

}  // namespace waymark
