#include "waymark/mapping/tag_votes.hpp"

#include <Eigen/LU>

namespace waymark::internal {

Vote<SE3> vote_for_place(const TagDetection& detection, const LapInput& lap, const SE3& map_T_base) {
  Vote<SE3> vote;
  const auto pose = estimate_tag_pose(detection, lap.sizes, lap.camera);
  if (!pose) return vote;
  const SE3 map_T_cam = map_T_base * lap.base_T_cam;
  const auto add = [&](const TagPoseSolution& solution) {
    const SE3::Jacobian Ad = map_T_cam.adjoint();
    // The pose of the base is not known to the micrometre either.
    const PoseCovariance covariance =
        Ad * solution.covariance * Ad.transpose() + 1e-4 * PoseCovariance::Identity();
    vote.push_back({map_T_cam * solution.cam_T_tag, covariance.inverse(), solution.chi2 - pose->best.chi2});
  };
  add(pose->best);
  if (pose->other) add(*pose->other);
  return vote;
}

}  // namespace waymark::internal
