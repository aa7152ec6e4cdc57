#include "waymark/mapping/lap/lap_confirmation.hpp"

#include <cmath>
#include <map>
#include <optional>

#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/lap/odometry_track.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"

namespace waymark::internal {
namespace {

/// The one or two poses of a tag.
std::vector<Hypothesis> poses_of(const TagPoseObservation& seen) {
  constexpr double kHopeless = 30;
  std::vector<Hypothesis> poses = {{seen.cam_T_tag, seen.covariance, 0}};
  if (seen.other && seen.other->chi2 - seen.chi2 < kHopeless)
    poses.push_back({seen.other->cam_T_tag, seen.other->covariance, seen.other->chi2 - seen.chi2});
  return poses;
}

/// Wheels whose scales nobody has found yet, on a floor that nobody has measured.
Matrix6 covariance_of(const SE2& motion) {
  constexpr double kOnce_m = 0.005;
  constexpr double kOnce_rad = 0.01;
  constexpr double kShare = 0.2;
  const double metres = kOnce_m + kShare * motion.translation().norm();
  const double radians = kOnce_rad + kShare * std::abs(motion.yaw());
  Vector6 sigma;
  sigma << metres, metres, kOnce_m, kOnce_rad, kOnce_rad, radians;
  return sigma.cwiseAbs2().asDiagonal();
}

std::vector<ViewMotion> motions_of(const LapInput& lap, const std::vector<ObservedFrame>& observed) {
  const OdometryTrack wheels(lap.odometry);
  std::vector<ViewMotion> motions(observed.size());
  std::optional<SE2> before;
  for (std::size_t f = 0; f < observed.size(); ++f) {
    const std::optional<SE2> now = wheels.at(observed[f].stamp);
    if (before && now) {
      const SE2 motion = before->inverse() * *now;
      const SE3 cam_T_base = observed[f - 1].base_T_cam.value_or(lap.base_T_cam).inverse();
      const Matrix6 Ad = cam_T_base.adjoint();
      motions[f] = {true, cam_T_base * lift(motion) * observed[f].base_T_cam.value_or(lap.base_T_cam),
                    Ad * covariance_of(motion) * Ad.transpose()};
    }
    before = now;
  }
  return motions;
}

}  // namespace

std::vector<ObservationIndex> unconfirmed_observations(const LapInput& lap,
                                                       const std::vector<ObservedFrame>& observed) {
  std::vector<ObservationIndex> indices;
  std::vector<ViewedTag> seen;
  std::vector<std::vector<Hypothesis>> poses;
  std::map<TagId, std::size_t> number;
  for (std::size_t f = 0; f < observed.size(); ++f) {
    const std::vector<TagDetection>& detections = lap.frames[f].detections;
    std::size_t next = 0;  // detections without a pose were not observed
    for (std::size_t d = 0; d < detections.size() && next < observed[f].tags.size(); ++d) {
      const TagPoseObservation& tag = observed[f].tags[next];
      if (detections[d].tag != tag.tag) continue;
      ++next;
      indices.push_back({f, d});
      seen.push_back({f, number.try_emplace(tag.tag, number.size()).first->second, 0});
      poses.push_back(poses_of(tag));
    }
  }
  const Confirmation confirmation = confirm_observations(seen, poses, motions_of(lap, observed));
  std::vector<ObservationIndex> doubtful;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (confirmation.doubtful[i] != 0) doubtful.push_back(indices[i]);
  }
  return doubtful;
}

}  // namespace waymark::internal
