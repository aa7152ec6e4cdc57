#include "waymark/mapping/lap/mounting_estimate.hpp"

#include <algorithm>
#include <cmath>

#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

/// What a robot's file is usually right to [m], [rad].
constexpr std::array<double, 6> kWorth = {0.01, 0.01, 0.01, 0.009, 0.009, 0.009};
constexpr int kHeight = 2;

/// Farther than chance (four standard deviations), and more than a robot's file is usually right to.
bool is_out(const Vector6& off, const Vector6& sigma, int i) {
  return std::abs(off[i]) > std::max(kWorth[static_cast<std::size_t>(i)], 4 * sigma[i]);
}

Vector6 between(const SE3& assumed, const SE3& found) {
  Vector6 off;
  off << found.translation() - assumed.translation(), (found.rotation() * assumed.rotation().inverse()).log();
  return off;
}

/// Centred where the camera is about to be found, so that what is trusted stays although it turns.
PosePriorFactor prior_of(const MountingBelief& belief) {
  constexpr double kWide = 0.1;  // [m], [rad]
  constexpr double kExactly = 1e-4;
  Vector6 sigma = Vector6::Constant(kWide);
  Vector6 off = belief.off;
  for (int i = 0; i < 6; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (i == kHeight || belief.trusted[at]) sigma[i] = kExactly;
    if (sigma[i] < kWide) off[i] = 0;
  }
  const SE3 centre(SO3::exp(off.tail<3>()) * belief.base_T_cam.rotation(),
                   belief.base_T_cam.translation() + off.head<3>());
  const Matrix6 P = sigma.cwiseAbs2().asDiagonal();
  return {centre, whitening_of(from_coordinate_covariance(centre, P).covariance)};
}

}  // namespace

std::optional<MountingEstimate> estimate_mounting(LapBundle& lap, int max_iterations,
                                                  const BundleProgress& progress,
                                                  const std::optional<MountingBelief>& given) {
  if (lap.bundle.odometry.empty()) return std::nullopt;
  BundlePose& cam = lap.bundle.poses[lap.cam];
  constexpr double kSlip_s = 0.1;
  constexpr double kLatency_s = 0.1;
  constexpr double kTurnLead_s = 0.03;
  constexpr double kYawBias_rad_s = 0.02;
  for (BundleScales& scales : lap.bundle.odometry_scales)
    scales.sigma = {scales.sigma.distance, scales.sigma.yaw, kSlip_s, kLatency_s,
                    kTurnLead_s,           kYawBias_rad_s};
  const MountingBelief belief = given.value_or(MountingBelief{.base_T_cam = cam.value});
  if (cam.fixed) {
    cam.fixed = false;
    lap.bundle.priors.push_back({lap.cam, prior_of(belief)});
  }
  const BundleSummary summary = solve(lap.bundle, {.max_iterations = max_iterations}, progress);
  if (!summary.usable()) return std::nullopt;
  MountingEstimate estimate{.base_T_cam = lap.bundle.poses[lap.cam].value};
  const BundleCovariance known = covariance(lap.bundle);
  estimate.scales = lap.bundle.odometry_scales[0].value;
  estimate.scales_sigma = OdometryScales::of(known.scales[0].diagonal().cwiseMax(0.0).cwiseSqrt());
  const Matrix6 P = coordinate_covariance(Uncertain<SE3>{estimate.base_T_cam, known.poses[lap.cam]});
  estimate.sigma = P.diagonal().cwiseMax(0.0).cwiseSqrt();
  estimate.off = between(belief.base_T_cam, estimate.base_T_cam);
  for (int i = 0; i < 6; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const bool held = i == kHeight || belief.trusted[at];
    estimate.out[at] = !held && is_out(estimate.off, estimate.sigma, i);
    estimate.untold[at] = held || (!estimate.out[at] && estimate.sigma[i] > kWorth[at]);
  }
  return estimate;
}

}  // namespace waymark
