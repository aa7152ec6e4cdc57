#include "waymark/mapping/lap/tag_votes.hpp"

#include <utility>

#include <Eigen/LU>

namespace waymark::internal {

namespace {

/// One alternative for each pose of the tag; `value_of` cam_T_tag, and in which frame a left tangent of it is
/// what errs.
template <class Value>
Vote<SE3> vote_of(const TagDetection& detection, const CameraModel& camera, const LapInput& lap,
                  const Value& value_of) {
  Vote<SE3> vote;
  const auto pose = estimate_tag_pose(detection, lap.sizes, camera);
  if (!pose) return vote;
  const auto add = [&](const TagPoseSolution& solution) {
    const auto [value, map_T_cam] = value_of(solution.cam_T_tag);
    const SE3::Jacobian Ad = map_T_cam.adjoint();
    // What it is seen from is not known to the micrometre either.
    const PoseCovariance covariance =
        Ad * solution.covariance * Ad.transpose() + 1e-4 * PoseCovariance::Identity();
    vote.push_back({value, covariance.inverse(), solution.chi2 - pose->best.chi2});
  };
  add(pose->best);
  if (pose->other) add(*pose->other);
  return vote;
}

}  // namespace

Vote<SE3> vote_for_place(const TagDetection& detection, const std::string& camera, const LapInput& lap,
                         const SE3& map_T_base) {
  const CameraView seen_by = camera_of(lap, camera);
  const SE3 map_T_cam = map_T_base * seen_by.base_T_cam;
  return vote_of(detection, seen_by.camera, lap,
                 [&](const SE3& cam_T_tag) { return std::pair(map_T_cam * cam_T_tag, map_T_cam); });
}

Vote<SE3> vote_for_base(const TagDetection& detection, const std::string& camera, const LapInput& lap,
                        const SE3& map_T_tag) {
  const CameraView seen_by = camera_of(lap, camera);
  const SE3 cam_T_base = seen_by.base_T_cam.inverse();
  return vote_of(detection, seen_by.camera, lap, [&](const SE3& cam_T_tag) {
    const SE3 map_T_cam = map_T_tag * cam_T_tag.inverse();
    return std::pair(map_T_cam * cam_T_base, map_T_cam);
  });
}

}  // namespace waymark::internal
