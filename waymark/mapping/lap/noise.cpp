#include "waymark/mapping/lap/noise.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/solver/correlated_errors.hpp"

namespace waymark::internal {
namespace {

constexpr double kResiduals = 8;  // for each observation

/// The median of chi-square (Wilson and Hilferty, "The Distribution of Chi-Square", PNAS 17, 1931).
double median_chi2(double dof) { return dof * std::pow(1 - 2 / (9 * dof), 3); }

/// The part of a term's redundancy that its base and tag poses use up: trace(J P J^T).
double used_up(const CornerTerm& term, const Bundle& bundle, const BundleCovariance& P,
               const Matrix6& P_rig_tag) {
  CornerJacobians J;
  J.wants_cam = J.wants_body = false;
  if (!corner_residual(term.factor, bundle.cameras[term.camera], poses_of(bundle, term), &J)) return 0;
  return (J.rig * P.poses[term.rig]).cwiseProduct(J.rig).sum() +
         (J.tag * P.poses[term.tag]).cwiseProduct(J.tag).sum() +
         2 * (J.rig * P_rig_tag).cwiseProduct(J.tag).sum();
}

}  // namespace

std::vector<double> redundancy_of(const LapBundle& lap) {
  std::vector<std::pair<PoseIndex, PoseIndex>> pairs;
  for (const CornerTerm& term : lap.bundle.corners) {
    if (term.used) pairs.emplace_back(term.rig, term.tag);
  }
  const BundleCovariance P = covariance(lap.bundle, pairs);
  std::vector<double> redundancy(lap.bundle.corners.size(), kResiduals);
  std::size_t pair = 0;
  for (std::size_t i = 0; i < redundancy.size(); ++i) {
    const CornerTerm& term = lap.bundle.corners[i];
    if (term.used) redundancy[i] -= used_up(term, lap.bundle, P, P.pairs[pair++]);
  }
  return redundancy;
}

double noise_ratio(const std::vector<double>& chi2, const std::vector<double>& redundancy) {
  constexpr std::size_t kMinRatios = 50;
  constexpr double kMinRedundancy = 2;  // a tag that is alone in its frame has hardly any redundancy
  std::vector<double> ratios;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    if (std::isfinite(chi2[i]) && redundancy[i] > kMinRedundancy)
      ratios.push_back(chi2[i] / median_chi2(redundancy[i]));
  }
  if (ratios.size() < kMinRatios) return 1;
  return std::sqrt(median(std::move(ratios)));
}

double correlated_frames_of(const LapBundle& lap) {
  std::vector<std::size_t> frames;
  frames.reserve(lap.observations.size());
  for (const LapBundle::Observation& seen : lap.observations) frames.push_back(seen.frame);
  return correlated_frames(lap.bundle, frames);
}

void scale_noise(Bundle& bundle, double ratio) {
  for (CornerTerm& term : bundle.corners) term.factor.whitening /= ratio;
}

}  // namespace waymark::internal

namespace waymark {
namespace {

/// A run of consecutive odometry terms; its last index is exclusive.
struct TermRun {
  std::size_t first = 0, last = 0;
};

/// Divides the terms into runs of at least this duration. If it is 0, each term is a run of its own.
std::vector<TermRun> term_runs(const std::vector<OdometryTerm>& odometry, double min_s) {
  std::vector<TermRun> result;
  for (std::size_t i = 0; i < odometry.size();) {
    TermRun stretch{i, i};
    double lasts_s = 0;
    do {
      lasts_s += odometry[stretch.last++].factor.duration_s;
    } while (lasts_s < min_s && stretch.last < odometry.size() &&
             odometry[stretch.last].a == odometry[stretch.last - 1].b);
    i = stretch.last;
    if (lasts_s >= min_s) result.push_back(stretch);
  }
  return result;
}

/// The scaled odometry of a run as a single motion, with the noise that results from independent errors.
OdometryFactor joined(const Bundle& bundle, const TermRun& stretch) {
  SE2 motion;
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  for (std::size_t i = stretch.first; i < stretch.last; ++i) {
    const OdometryTerm& term = bundle.odometry[i];
    motion = motion * scaled_motion(term.factor, bundle.odometry_scales[term.scales].value);
    variance += term.factor.whitening.diagonal().cwiseAbs2().cwiseInverse();
  }
  return {motion, variance.cwiseSqrt().cwiseInverse().asDiagonal()};
}

/// The expected mean squares of the whitened residuals, including the uncertainty of the poses.
Eigen::Vector3d expected_squares(const Bundle& bundle, const std::vector<TermRun>& stretches) {
  std::vector<std::pair<PoseIndex, PoseIndex>> pairs;
  pairs.reserve(stretches.size());
  for (const TermRun& s : stretches)
    pairs.emplace_back(bundle.odometry[s.first].a, bundle.odometry[s.last - 1].b);
  const BundleCovariance P = covariance(bundle, pairs);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const auto& [a, b] = pairs[i];
    OdometryJacobians J;
    const Eigen::Vector3d r =
        odometry_residual(joined(bundle, stretches[i]), {}, bundle.poses[a].value, bundle.poses[b].value, &J);
    const Eigen::Matrix3d spread = J.a * P.poses[a] * J.a.transpose() + J.b * P.poses[b] * J.b.transpose() +
                                   2 * J.a * P.pairs[i] * J.b.transpose();
    sum += r.cwiseAbs2() + spread.diagonal().cwiseMax(0.0);
  }
  return sum / static_cast<double>(stretches.size());
}

}  // namespace

OdometryNoise fit_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress) {
  constexpr int kRounds = 15;
  constexpr double kConverged = 0.03;
  constexpr double kOverRelaxation = 1.8;  // steps of the EM method are too short, but in the right direction
  constexpr double kRun_s = 0.5;
  constexpr std::size_t kMinRuns = 30;
  OdometryNoise noise = OdometryNoise::Ones();
  if (lap.bundle.odometry.empty()) return noise;
  const std::vector<TermRun> single = term_runs(lap.bundle.odometry, 0);
  const std::vector<TermRun> together = term_runs(lap.bundle.odometry, kRun_s);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Vector3d squares = expected_squares(lap.bundle, single);
    if (together.size() >= kMinRuns) squares = squares.cwiseMax(expected_squares(lap.bundle, together));
    squares = squares.cwiseMax(0.04).cwiseMin(25.0);
    const Eigen::Vector3d factor = squares.array().pow(kOverRelaxation / 2);
    noise = noise.cwiseProduct(factor);
    for (OdometryTerm& term : lap.bundle.odometry)
      term.factor.whitening = factor.cwiseInverse().asDiagonal() * term.factor.whitening;
    if (!solve(lap.bundle, {.max_iterations = max_iterations}, progress).usable()) break;
    if (squares.array().log().abs().maxCoeff() < kConverged) break;
  }
  return noise;
}

namespace {

/// Distance and rotation by odometry up to a given time.
struct Driven {
  SensorTime stamp{};
  double way_m = 0;
  double turned_rad = 0;
};

double straight(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

std::vector<Driven> sums_of(const std::vector<Odometry>& odometry) {
  std::vector<Driven> sums;
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    Driven next{.stamp = odometry[i].stamp};
    if (i > 0) {
      const SE2 moved = odometry[i - 1].odom_T_base.inverse() * odometry[i].odom_T_base;
      next.way_m = sums.back().way_m + moved.translation().norm();
      next.turned_rad = sums.back().turned_rad + moved.yaw();
    }
    sums.push_back(next);
  }
  return sums;
}

std::optional<Driven> at(const std::vector<Driven>& sums, SensorTime stamp) {
  const auto after = std::ranges::lower_bound(sums, stamp, {}, &Driven::stamp);
  if (after == sums.begin() || after == sums.end()) return std::nullopt;
  const Driven& a = *std::prev(after);
  const Driven& b = *after;
  constexpr double kGap_s = 0.3;
  const double gap_s = to_seconds(b.stamp - a.stamp);
  if (gap_s > kGap_s) return std::nullopt;
  const double share = to_seconds(stamp - a.stamp) / gap_s;
  return Driven{stamp, a.way_m + share * (b.way_m - a.way_m),
                a.turned_rad + share * (b.turned_rad - a.turned_rad)};
}

/// One second of a drive, according to a trajectory and to odometry.
struct Stretch {
  double lasts_s = 0;
  double way_m = 0;
  double odometry_rad = 0;  ///< rotation by odometry
  double turned_rad = 0;    ///< rotation by the trajectory, modulo whole turns
};

std::vector<Stretch> stretches_between(const Trajectory& trajectory, const std::vector<Matrix6>& covariance,
                                       const std::vector<Odometry>& odometry) {
  constexpr double kStretch_s = 1;
  constexpr double kMaxStretch_s = 1.5;
  constexpr double kMaxHeadingSigma_rad = 0.009;
  constexpr double kMinDistance_m = 0.05;
  if (covariance.size() != trajectory.size()) return {};
  const std::vector<Driven> sums = sums_of(odometry);
  std::vector<Stretch> stretches;
  std::optional<Driven> from;
  double from_yaw = 0;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const SensorTime stamp = trajectory[i].stamp;
    if (from && to_seconds(stamp - from->stamp) < kStretch_s) continue;
    if (std::sqrt(std::max(0.0, covariance[i](5, 5))) > kMaxHeadingSigma_rad) continue;
    const auto to = at(sums, stamp);
    if (!to) continue;
    const double yaw = project_to_plane(trajectory[i].map_T_base).yaw();
    if (from && to_seconds(stamp - from->stamp) < kMaxStretch_s && to->way_m - from->way_m > kMinDistance_m)
      stretches.push_back({to_seconds(stamp - from->stamp), to->way_m - from->way_m,
                           to->turned_rad - from->turned_rad, yaw - from_yaw});
    from = to;
    from_yaw = yaw;
  }
  return stretches;
}

constexpr std::size_t kMinTurnStretches = 10;

}  // namespace

std::optional<TurnNoise> turn_noise(const Trajectory& trajectory, const std::vector<Matrix6>& covariance,
                                    const std::vector<Odometry>& odometry, double yaw_scale) {
  const std::vector<Stretch> stretches = stretches_between(trajectory, covariance, odometry);
  if (stretches.size() < kMinTurnStretches) return std::nullopt;
  double squares = 0;
  double way = 0;
  double worth = 0;
  for (const Stretch& s : stretches) {
    const double off = straight(s.turned_rad - yaw_scale * s.odometry_rad);
    squares += off * off;
    way += s.way_m;
    worth += s.odometry_rad * s.odometry_rad / s.way_m;
  }
  TurnNoise noise{.rad_sqrt_m = std::sqrt(squares / way), .stretches = static_cast<int>(stretches.size())};
  noise.scale_sigma = worth > 0 ? noise.rad_sqrt_m / std::sqrt(worth) : 0;
  return noise;
}

std::optional<double> turn_scale(const Trajectory& trajectory, const std::vector<Matrix6>& covariance,
                                 const std::vector<Odometry>& odometry) {
  const std::vector<Stretch> stretches = stretches_between(trajectory, covariance, odometry);
  double both = 0;
  double worth = 0;
  for (const Stretch& s : stretches) {
    const double turned_rad = straight(s.turned_rad);
    both += s.odometry_rad * turned_rad / s.way_m;
    worth += turned_rad * turned_rad / s.way_m;
  }
  if (stretches.size() < kMinTurnStretches || !(both > 0)) return std::nullopt;
  return worth / both;
}

std::optional<double> turn_scale_sigma(const Trajectory& trajectory, const std::vector<Matrix6>& covariance,
                                       const std::vector<Odometry>& odometry) {
  const std::vector<Stretch> stretches = stretches_between(trajectory, covariance, odometry);
  if (stretches.size() < kMinTurnStretches) return std::nullopt;
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  double squares = 0;
  for (const Stretch& s : stretches) {
    const Eigen::Vector2d row(straight(s.turned_rad), s.lasts_s);
    A += row * row.transpose();
    b += s.odometry_rad * row;
    squares += s.odometry_rad * s.odometry_rad;
  }
  constexpr double kMinCorrelation = 0.7;
  const double determinant = A.determinant();
  const double correlation = A(0, 1) / std::sqrt(A(0, 0) * A(1, 1));
  if (!(determinant > 0) || !(std::abs(correlation) > kMinCorrelation)) return std::nullopt;
  const Eigen::Vector2d x = A.ldlt().solve(b);  // ratio of odometry turns to true turns, and the rate error
  const double left_over = std::max(0.0, squares - b.dot(x)) / static_cast<double>(stretches.size() - 2);
  const double sigma = std::sqrt(left_over * A(1, 1) / determinant);
  return sigma / (x[0] * x[0]);
}

}  // namespace waymark
