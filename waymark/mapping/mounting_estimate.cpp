#include "waymark/mapping/mounting_estimate.hpp"

#include <cmath>

#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

/// Farther than chance (four standard deviations), and more than a robot's file is usually right to.
bool stands_out(const Vector6& off, const Vector6& sigma) {
  constexpr double kWorth_m = 0.01;
  constexpr double kWorth_rad = 0.009;
  for (int i = 0; i < 6; ++i) {
    if (std::abs(off[i]) > std::max(i < 3 ? kWorth_m : kWorth_rad, 4 * sigma[i])) return true;
  }
  return false;
}

}  // namespace

std::optional<MountingEstimate> estimate_mounting(LapBundle& lap, int max_iterations,
                                                  const BundleProgress& progress,
                                                  const std::optional<SE3>& given) {
  if (lap.bundle.odometry.empty()) return std::nullopt;
  BundlePose& cam = lap.bundle.poses[lap.cam];
  constexpr double kSlip_s = 0.1;
  constexpr double kLatency_s = 0.1;
  constexpr double kTurnLead_s = 0.03;
  constexpr double kYawBias_rad_s = 0.02;
  for (BundleScales& scales : lap.bundle.odometry_scales)
    scales.sigma = {scales.sigma.distance, scales.sigma.yaw, kSlip_s, kLatency_s,
                    kTurnLead_s,           kYawBias_rad_s};
  const SE3 believed = given.value_or(cam.value);
  if (cam.fixed) {
    cam.fixed = false;
    Vector6 variance;
    variance << 0.01, 0.01, 1e-8, 0.01, 0.01, 0.01;
    const Matrix6 P = variance.asDiagonal();
    lap.bundle.priors.push_back(
        {lap.cam, {believed, whitening_of(from_coordinate_covariance(believed, P).covariance)}});
  }
  const BundleSummary summary = solve(lap.bundle, {.max_iterations = max_iterations}, progress);
  if (!summary.usable()) return std::nullopt;
  MountingEstimate estimate{.base_T_cam = lap.bundle.poses[lap.cam].value};
  const BundleCovariance known = covariance(lap.bundle);
  estimate.scales = lap.bundle.odometry_scales[0].value;
  estimate.scales_sigma = OdometryScales::of(known.scales[0].diagonal().cwiseMax(0.0).cwiseSqrt());
  const Matrix6 P = coordinate_covariance(Uncertain<SE3>{estimate.base_T_cam, known.poses[lap.cam]});
  estimate.sigma = P.diagonal().cwiseMax(0.0).cwiseSqrt();
  estimate.off << estimate.base_T_cam.translation() - believed.translation(),
      (estimate.base_T_cam.rotation() * believed.rotation().inverse()).log();
  estimate.stands_out = stands_out(estimate.off, estimate.sigma);
  return estimate;
}

}  // namespace waymark
