#include "waymark/mapping/lap/mounting_estimate.hpp"

#include <algorithm>
#include <cmath>

#include "waymark/camera/intrinsics.hpp"
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

/// Errors of a pose by tags are turns about the tags: the farther its base is from them, the more it seems to
/// rise and sink. With heights as sure as a floor is even, the base is drawn to where they move least, which
/// is nearer to the tags (the poses are unknowns that grow in number with the observations: Neyman and Scott,
/// "Consistent estimates based on partially consistent observations", 1948). The force goes with the square.
void doubt_heights(Bundle& bundle) {
  constexpr double kLess = 4;
  for (OnFloorTerm& term : bundle.on_floor) term.factor.height_sigma_m *= kLess;
}

/// The focal length of the first camera near what is given; all other numbers of cameras stay.
void free_focal_length(double share, Bundle& bundle) {
  bundle.intrinsics.resize(bundle.cameras.size());
  BundleIntrinsics& free = bundle.intrinsics[0];
  free.prior = intrinsics_of(bundle.cameras[0]);
  constexpr double kKnown = 1e-6;
  free.sigma = Eigen::VectorXd::Constant(free.prior.size(), kKnown);
  free.sigma.head<2>() = share * free.prior.head<2>().cwiseAbs();
}

void read_focal_length(const Bundle& bundle, const BundleCovariance& known, MountingEstimate& estimate) {
  if (bundle.intrinsics.empty() || known.intrinsics[0].size() == 0) return;
  const Eigen::Vector2d given = bundle.intrinsics[0].prior.head<2>();
  estimate.focal_scale = given.cwiseInverse().dot(intrinsics_of(bundle.cameras[0]).head<2>()) / 2;
  estimate.focal_scale_sigma = internal::focal_scale_sigma(bundle, known.intrinsics[0]);
}

}  // namespace

namespace internal {

double focal_scale_sigma(const Bundle& bundle, const Eigen::MatrixXd& intrinsics_covariance) {
  const Eigen::Vector2d mean = bundle.intrinsics[0].prior.head<2>().cwiseInverse() / 2;
  const Eigen::Matrix2d P = intrinsics_covariance.topLeftCorner<2, 2>();
  return std::sqrt(std::max(0.0, mean.dot(P * mean)));
}

}  // namespace internal

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
    doubt_heights(lap.bundle);
    lap.bundle.priors.push_back({lap.cam, prior_of(belief)});
  }
  if (belief.focal_share > 0 && lap.bundle.intrinsics.empty())
    free_focal_length(belief.focal_share, lap.bundle);
  const BundleSummary summary = solve(lap.bundle, {.max_iterations = max_iterations}, progress);
  if (!summary.usable()) return std::nullopt;
  MountingEstimate estimate{.base_T_cam = lap.bundle.poses[lap.cam].value, .camera = lap.bundle.cameras[0]};
  const BundleCovariance known = covariance(lap.bundle);
  estimate.scales = lap.bundle.odometry_scales[0].value;
  estimate.scales_sigma = OdometryScales::of(known.scales[0].diagonal().cwiseMax(0.0).cwiseSqrt());
  const Matrix6 P = coordinate_covariance(Uncertain<SE3>{estimate.base_T_cam, known.poses[lap.cam]});
  estimate.sigma = P.diagonal().cwiseMax(0.0).cwiseSqrt();
  read_focal_length(lap.bundle, known, estimate);
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
