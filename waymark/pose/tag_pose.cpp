#include "waymark/pose/tag_pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include "waymark/pose/pose_refinement.hpp"
#include "waymark/pose/square_pose.hpp"

namespace waymark {
namespace {

using internal::Corners3;
using internal::Matrix6;
using internal::Matrix86;
using internal::NormalEquations;
using internal::Refined;
using internal::Vector6;
using internal::Vector8;
using internal::Whitening;

/// Two minima that are closer than this many standard deviations count as one, because the difference is
/// within the tolerance of the iteration.
constexpr double kSameMinimumSigmas = 0.1;

/// Factor on the variance of the corners that their residual implies: the scale factor of the Particle Data
/// Group ("Review of particle physics", section 5.2.2), chi2 per degree of freedom. Two degrees of freedom
/// determine it only roughly, so it starts where chance is excluded and rises from 1 without a jump.
double variance_scale(double chi2) {
  constexpr double kDegreesOfFreedom = 2;
  constexpr double kByChance = 13.8;  // 0.999 quantile of chi-square for 2 degrees of freedom
  return std::max(1.0, std::min(chi2 / kDegreesOfFreedom, 1 + chi2 - kByChance));
}

void scale_covariance(double variance, TagPoseSolution& solution) {
  if (variance == 1) return;
  solution.sigma_scale = std::sqrt(variance);
  solution.covariance *= variance;
  solution.lens_covariance *= variance;
}

/// The inputs to one refinement.
struct Problem {
  const CameraModel& camera;
  const TagDetection& detection;
  Corners3 tag_corners;
  Whitening whitening;
  const IntrinsicsCovariance& intrinsics_covariance;
};

Corners3 corners_in_camera(const SE3& cam_T_tag, const Corners3& tag_corners) {
  const Eigen::Matrix3d R = cam_T_tag.rotation().matrix();
  Corners3 cam_corners;
  for (std::size_t i = 0; i < 4; ++i) cam_corners[i] = R * tag_corners[i] + cam_T_tag.translation();
  return cam_corners;
}

std::optional<Refined> refine_solution(const Problem& problem, const SE3& start, int max_iterations) {
  const auto centre = [](const SE3& cam_T_tag) -> const Eigen::Vector3d& { return cam_T_tag.translation(); };
  const auto evaluate = [&](const SE3& cam_T_tag, const Eigen::Vector3d& pivot, NormalEquations& normal) {
    Vector8 e;
    Matrix86 J;
    const Corners3 cam_corners = corners_in_camera(cam_T_tag, problem.tag_corners);
    if (!internal::corner_residuals(problem.camera, cam_corners, pivot, problem.detection.corners_px, e, J))
      return false;
    problem.whitening.apply(e, J);
    normal.add(e, J);
    return true;
  };
  return internal::refine(start, max_iterations, centre, evaluate);
}

double rms_px(const Problem& problem, const SE3& cam_T_tag) {
  double squared = 0;
  const Corners3 cam_corners = corners_in_camera(cam_T_tag, problem.tag_corners);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto px = problem.camera.project(cam_corners[i]);
    if (px) squared += (*px - problem.detection.corners_px[i]).squaredNorm();
  }
  return std::sqrt(squared / 4);
}

/// A solution and its chi2 if the covariance of the corners' residuals includes the uncertainty of the lens.
struct SolutionWithLens {
  TagPoseSolution solution{};
  double chi2_with_lens = 0;
};

/// Adds the uncertainty of the lens, equation (24). `inverse` is the covariance from the corners at
/// the pivot.
bool add_lens(const Problem& problem, const Refined& refined, const Matrix6& inverse,
              SolutionWithLens& candidate) {
  const SE3& cam_T_tag = refined.cam_T_ref;
  const Corners3 cam_corners = corners_in_camera(cam_T_tag, problem.tag_corners);
  Vector8 e;
  Matrix86 J;
  auto C = internal::lens_residual_covariance(problem.camera, cam_corners, problem.intrinsics_covariance);
  if (!C || !internal::corner_residuals(problem.camera, cam_corners, cam_T_tag.translation(),
                                        problem.detection.corners_px, e, J))
    return false;
  problem.whitening.apply(e, J);
  problem.whitening.apply_to_covariance(*C);
  const Eigen::Matrix<double, 6, 8> gain = inverse.lazyProduct(J.transpose());
  const Matrix6 Ad = internal::shift_adjoint(cam_T_tag.translation());
  const Eigen::Matrix<double, 6, 8> shifted = Ad.lazyProduct(gain);
  const Matrix6 lens = shifted.lazyProduct(*C).eval().lazyProduct(shifted.transpose());
  candidate.solution.lens_covariance = (lens + lens.transpose()) / 2;
  candidate.solution.covariance += candidate.solution.lens_covariance;
  // The pose absorbs the part of a lens error that looks like a change of pose.
  const CornerCovariance rest = CornerCovariance::Identity() - J.lazyProduct(gain);
  const CornerCovariance S =
      CornerCovariance::Identity() + rest.lazyProduct(*C).eval().lazyProduct(rest.transpose());
  const double explained = e.dot(e - S.llt().solve(e));
  if (explained > 0) candidate.chi2_with_lens = std::max(0.0, candidate.chi2_with_lens - explained);
  return true;
}

std::optional<SolutionWithLens> solution_with_lens(const Problem& problem, const Refined& refined) {
  const std::optional<internal::Cholesky6> information = internal::Cholesky6::of(refined.normal.H);
  if (!information) return std::nullopt;
  const Matrix6 Ad = internal::shift_adjoint(refined.cam_T_ref.translation());
  const Matrix6 inverse = information->inverse();
  SolutionWithLens candidate{.solution = {.cam_T_tag = refined.cam_T_ref,
                                          .chi2 = refined.normal.chi2,
                                          .rms_px = rms_px(problem, refined.cam_T_ref),
                                          .covariance = Ad.lazyProduct(inverse).lazyProduct(Ad.transpose())},
                             .chi2_with_lens = refined.normal.chi2};
  if (problem.intrinsics_covariance.size() > 0 && !add_lens(problem, refined, inverse, candidate))
    return std::nullopt;
  return candidate;
}

/// Distance from a to b in standard deviations of a, about the centre of the tag.
double sigmas_apart(const Refined& a, const Refined& b) {
  Vector6 xi;
  xi << b.cam_T_ref.translation() - a.cam_T_ref.translation(),
      (b.cam_T_ref.rotation() * a.cam_T_ref.rotation().inverse()).log();
  return std::sqrt(std::max(0.0, xi.dot(a.normal.H * xi)));
}

Result<TagPose> solve(const Problem& problem, const std::array<SE3, 2>& starts, int max_iterations) {
  std::array<std::optional<Refined>, 2> refined;
  std::array<std::optional<SolutionWithLens>, 2> found;
  for (std::size_t i = 0; i < 2; ++i) {
    refined[i] = refine_solution(problem, starts[i], max_iterations);
    if (refined[i]) found[i] = solution_with_lens(problem, *refined[i]);
  }
  const std::size_t best =
      found[1] && (!found[0] || found[1]->solution.chi2 < found[0]->solution.chi2) ? 1 : 0;
  if (!found[best]) {
    return fail(ErrorCode::InvalidArgument, "no pose in front of the camera fits the corners of the tag",
                {.key = to_string(problem.detection.tag)},
                "Check the corners and their order, and the camera calibration.");
  }
  TagPose pose{.best = found[best]->solution};
  const std::size_t other = 1 - best;
  if (!refined[other]) {
    pose.other_state = OtherSolution::NotVisible;
  } else if (!found[other] || !refined[other]->converged) {
    pose.other_state = OtherSolution::NotConverged;
  } else if (sigmas_apart(*refined[best], *refined[other]) < kSameMinimumSigmas) {
    pose.other_state = OtherSolution::SameMinimum;
  } else {
    pose.other = found[other]->solution;
  }
  const double variance = variance_scale(found[best]->chi2_with_lens);
  scale_covariance(variance, pose.best);
  if (pose.other) scale_covariance(variance, *pose.other);
  return pose;
}

Status check_lens(const CameraModel& camera, const IntrinsicsCovariance& C) {
  if (C.size() == 0) return {};
  const auto on_axis = intrinsics_jacobian(camera, Eigen::Vector3d::UnitZ());
  const bool fits = on_axis && C.rows() == on_axis->cols();
  if (fits && is_covariance(C)) return {};
  return fail(
      ErrorCode::InvalidArgument,
      fits ? "the covariance of the camera parameters is not finite, symmetric and positive semidefinite"
           : "the covariance of the camera parameters has another size than these parameters",
      {.key = "intrinsics_covariance"}, "Pass the covariance of fx, fy, cx, cy, k1, … in this order.");
}

}  // namespace

double TagPose::ambiguity_ratio() const {
  if (!other) return 0;
  return other->rms_px > 0 ? std::min(1.0, best.rms_px / other->rms_px) : 1;
}

double TagPose::likelihood_ratio() const { return other ? std::exp((best.chi2 - other->chi2) / 2) : 0; }

Result<TagPose> estimate_tag_pose(const TagDetection& detection, double size_m, const CameraModel& camera,
                                  const TagPoseOptions& options) {
  if (const Status status = check_ranges(options); !status) return tl::unexpected<Error>(status.error());
  if (const Status lens = check_lens(camera, options.intrinsics_covariance); !lens)
    return tl::unexpected<Error>(lens.error());
  const auto starts = internal::starting_poses(detection, size_m, camera);
  if (!starts) return tl::unexpected<Error>(starts.error());
  const auto whitening = internal::whitening_of(detection, options.corner_sigma_px);
  if (!whitening) return tl::unexpected<Error>(whitening.error());
  return solve({camera, detection, square_corners(size_m), *whitening, options.intrinsics_covariance},
               *starts, options.max_iterations);
}

Result<TagPose> estimate_tag_pose(const TagDetection& detection, const TagSizes& sizes,
                                  const CameraModel& camera, const TagPoseOptions& options) {
  const Result<double> size = sizes.size_m(detection.tag);
  if (!size) return tl::unexpected<Error>(size.error());
  return estimate_tag_pose(detection, *size, camera, options);
}

PoseDeviations standard_deviations(const SE3& a_T_b, const PoseCovariance& covariance) {
  const SE3::Tangent deviations = coordinate_deviations(Uncertain<SE3>{a_T_b, covariance});
  return {deviations.head<3>(), deviations.tail<3>()};
}

}  // namespace waymark
