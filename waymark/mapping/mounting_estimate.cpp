#include "waymark/mapping/mounting_estimate.hpp"

#include <algorithm>
#include <cmath>

#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

constexpr std::array<double, 6> kWorth = {0.01, 0.01, 0.01, 0.009, 0.009, 0.009};  // [m], [rad]

/// Farther than chance (four standard deviations), and more than a robot's file is usually right to.
bool stands_out(const Vector6& off, const Vector6& sigma, int i) {
  return std::abs(off[i]) > std::max(kWorth[static_cast<std::size_t>(i)], 4 * sigma[i]);
}

}  // namespace

std::optional<MountingEstimate> estimate_mounting(LapBundle& lap, int max_iterations,
                                                  const BundleProgress& progress,
                                                  const std::optional<SE3>& given,
                                                  const std::array<bool, 6>& held) {
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
    for (int i = 0; i < 6; ++i) {
      if (held[static_cast<std::size_t>(i)]) variance[i] = 1e-8;
    }
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
  for (int i = 0; i < 6; ++i) {
    const bool out = stands_out(estimate.off, estimate.sigma, i);
    const auto at = static_cast<std::size_t>(i);
    estimate.stands_out = estimate.stands_out || out;
    estimate.untold[at] = i == 2 || held[at] || (!out && estimate.sigma[i] > kWorth[at]);
  }
  return estimate;
}

}  // namespace waymark
