#include "waymark/mapping/solver/pose_votes.hpp"

#include <algorithm>

#include <Eigen/LU>

#include "waymark/pose/tag_pose.hpp"

namespace waymark::internal {
namespace {

/// A product of uncertain transforms, as they come.
class Chain {
 public:
  Chain& times(const Hypothesis& next) {
    const Matrix6 Ad = value_.adjoint();
    covariance_ += Ad * next.covariance * Ad.transpose();
    value_ = value_ * next.value;
    chi2_ += next.chi2;
    return *this;
  }
  Chain& times_inverse(const Hypothesis& next) {
    value_ = value_ * next.value.inverse();
    const Matrix6 Ad = value_.adjoint();
    covariance_ += Ad * next.covariance * Ad.transpose();
    chi2_ += next.chi2;
    return *this;
  }
  [[nodiscard]] Alternative<SE3> result() const {
    // Nothing is known to the micrometre.
    const Matrix6 covariance = covariance_ + 1e-5 * Matrix6::Identity();
    return {value_, covariance.inverse(), chi2_};
  }

 private:
  SE3 value_{};
  Matrix6 covariance_ = Matrix6::Zero();
  double chi2_ = 0;
};

/// cam_T_tag = (rig cam)^-1 body tag, solved for one of them.
Alternative<SE3> solved_for(Role role, const std::array<const Hypothesis*, 4>& at, const Hypothesis& Z) {
  Chain chain;
  switch (role) {
    case Role::Rig:
      return chain.times(*at[2]).times(*at[3]).times_inverse(Z).times_inverse(*at[1]).result();
    case Role::Cam:
      return chain.times_inverse(*at[0]).times(*at[2]).times(*at[3]).times_inverse(Z).result();
    case Role::Body:
      return chain.times(*at[0]).times(*at[1]).times(Z).times_inverse(*at[3]).result();
    case Role::Tag:
      break;
  }
  return chain.times_inverse(*at[2]).times(*at[0]).times(*at[1]).times(Z).result();
}

}  // namespace

std::vector<Hypothesis> poses_of_square(const Bundle& bundle, const CornerTerm& term,
                                        double corner_sigma_px) {
  TagDetection detection;
  detection.corners_px = term.factor.corners_px;
  const auto pose = estimate_tag_pose(detection, term.factor.size_m, bundle.cameras[term.camera],
                                      {.corner_sigma_px = corner_sigma_px});
  std::vector<Hypothesis> squares;
  if (!pose) return squares;
  constexpr double kHopeless = 30;
  squares.push_back({pose->best.cam_T_tag, pose->best.covariance, 0});
  const double worse = pose->other ? pose->other->chi2 - pose->best.chi2 : kHopeless;
  if (worse < kHopeless) squares.push_back({pose->other->cam_T_tag, pose->other->covariance, worse});
  return squares;
}

Vote<SE3> vote_for(Role role, const std::array<const std::vector<Hypothesis>*, 4>& of_poses,
                   const std::vector<Hypothesis>& squares) {
  static const std::vector<Hypothesis> kNone(1);
  std::array<const std::vector<Hypothesis>*, 4> sets = of_poses;
  sets[static_cast<std::size_t>(role)] = &kNone;
  Vote<SE3> vote;
  for (const Hypothesis& rig : *sets[0]) {
    for (const Hypothesis& cam : *sets[1]) {
      for (const Hypothesis& body : *sets[2]) {
        for (const Hypothesis& tag : *sets[3]) {
          for (const Hypothesis& Z : squares) vote.push_back(solved_for(role, {&rig, &cam, &body, &tag}, Z));
        }
      }
    }
  }
  std::ranges::stable_sort(vote, {}, &Alternative<SE3>::chi2);
  return vote;
}

}  // namespace waymark::internal
