#include "waymark/evaluation/trajectory_scores.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "waymark/base/angles.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

Duration duration_of(double seconds) { return Duration(std::llround(seconds * 1e9)); }

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

/// Error of the estimate in x, y and yaw, after alignment.
Eigen::Vector3d planar_error(const PosePair& pair, const Alignment& alignment) {
  const SE2 estimated = project_to_plane(alignment(pair.estimated.map_T_base));
  const SE2 reference = project_to_plane(pair.reference);
  return {estimated.x() - reference.x(), estimated.y() - reference.y(),
          wrapped(estimated.yaw() - reference.yaw())};
}

/// The covariance of the aligned estimate: its position turned and scaled as the estimate was.
Eigen::Matrix3d aligned_covariance(const Eigen::Matrix3d& covariance, const Alignment& alignment) {
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  const double yaw = project_to_plane(alignment.ref_T_est).yaw();
  J.topLeftCorner<2, 2>() = alignment.scale * Eigen::Rotation2Dd(yaw).toRotationMatrix();
  return J * covariance * J.transpose();
}

std::optional<Consistency> consistency_of(const std::vector<PosePair>& pairs, const Alignment& alignment) {
  constexpr double kChiSquare3At95 = 7.814727903251179;
  std::vector<double> nees;
  Consistency found;
  for (const PosePair& pair : pairs) {
    if (!pair.estimated.covariance) continue;
    const Eigen::LLT<Eigen::Matrix3d> factor(aligned_covariance(*pair.estimated.covariance, alignment));
    const double value = factor.matrixL().solve(planar_error(pair, alignment)).squaredNorm();
    if (factor.info() == Eigen::Success && std::isfinite(value)) {
      nees.push_back(value);
    } else {
      ++found.refused;
    }
  }
  if (nees.empty() && found.refused == 0) return std::nullopt;
  found.count = nees.size();
  const auto inside = std::ranges::count_if(nees, [](double value) { return value <= kChiSquare3At95; });
  if (!nees.empty()) found.inside_95 = static_cast<double>(inside) / static_cast<double>(nees.size());
  const ErrorStatistics statistics = statistics_of(std::move(nees));
  found.nees_mean = statistics.mean;
  found.nees_median = statistics.median;
  return found;
}

/// The error of the motion from pair i to pair j, seen from the base at i.
SE3 motion_error(const PosePair& i, const PosePair& j, double scale) {
  SE3 estimated = i.estimated.map_T_base.inverse() * j.estimated.map_T_base;
  estimated = SE3(estimated.rotation(), scale * estimated.translation());
  return (i.reference.inverse() * j.reference).inverse() * estimated;
}

/// Where each pair is on the scale that the stretches are measured by: seconds, or metres of the reference.
std::vector<double> positions_along(const std::vector<PosePair>& pairs, bool by_metres) {
  std::vector<double> along;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    double at = to_seconds(pairs[i].estimated.stamp - pairs.front().estimated.stamp);
    if (by_metres)
      at = i == 0 ? 0
                  : along.back() +
                        (pairs[i].reference.translation() - pairs[i - 1].reference.translation()).norm();
    along.push_back(at);
  }
  return along;
}

RelativeErrors relative_errors(const std::vector<PosePair>& pairs, double scale,
                               const TrajectoryScoreOptions& options) {
  constexpr double kRounding = 1e-9;
  const bool by_metres = options.rpe_delta_m > 0;
  const double delta = by_metres ? options.rpe_delta_m : options.rpe_delta_s;
  const std::vector<double> along = positions_along(pairs, by_metres);
  std::vector<double> metres;
  std::vector<double> degrees;
  std::size_t j = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    while (j < pairs.size() && along[j] < along[i] + delta - kRounding) ++j;
    if (j == pairs.size()) break;
    const SE3 error = motion_error(pairs[i], pairs[j], scale);
    metres.push_back(error.translation().norm());
    degrees.push_back(to_degrees(error.rotation().log().norm()));
  }
  return {statistics_of(std::move(metres)), statistics_of(std::move(degrees))};
}

}  // namespace

std::size_t count_jumps(const std::vector<PosePair>& pairs, const TrajectoryScoreOptions& options) {
  std::size_t jumps = 0;
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    if (pairs[i].estimated.stamp - pairs[i - 1].estimated.stamp > duration_of(options.max_gap_s)) continue;
    const SE3 error = motion_error(pairs[i - 1], pairs[i], 1);
    if (error.translation().norm() > options.jump_m ||
        to_degrees(error.rotation().log().norm()) > options.jump_deg)
      ++jumps;
  }
  return jumps;
}

double covered_share(const EstimatedTrajectory& estimated, SensorTime from, SensorTime to, Duration max_gap) {
  if (to <= from) return estimated.empty() ? 0 : 1;
  Duration covered{0};
  for (std::size_t i = 1; i < estimated.size(); ++i) {
    const SensorTime begin = std::max(from, estimated[i - 1].stamp);
    const SensorTime end = std::min(to, estimated[i].stamp);
    if (end > begin && estimated[i].stamp - estimated[i - 1].stamp <= max_gap) covered += end - begin;
  }
  return to_seconds(covered) / to_seconds(to - from);
}

Result<TrajectoryScores> score_trajectory(const std::vector<PosePair>& pairs, AlignmentKind kind,
                                          const TrajectoryScoreOptions& options) {
  if (pairs.empty())
    return fail(ErrorCode::NotFound, "no estimate is at a time the reference knows", {},
                "Are both of the same drive, on the same clock?");
  const Result<Alignment> alignment = align(pairs, kind);
  if (!alignment) return tl::unexpected(alignment.error());
  std::vector<double> metres;
  std::vector<double> rotations;
  std::vector<double> headings;
  for (const PosePair& pair : pairs) {
    const SE3 estimated = (*alignment)(pair.estimated.map_T_base);
    metres.push_back((estimated.translation() - pair.reference.translation()).norm());
    rotations.push_back(
        to_degrees((pair.reference.rotation().inverse() * estimated.rotation()).log().norm()));
    headings.push_back(to_degrees(planar_error(pair, *alignment).z()));
  }
  TrajectoryScores scores{.alignment = *alignment, .end_error_m = metres.back()};
  scores.ate_m = statistics_of(std::move(metres));
  scores.rotation_deg = statistics_of(std::move(rotations));
  scores.heading_deg = statistics_of(std::move(headings));
  scores.relative = relative_errors(pairs, alignment->scale, options);
  scores.consistency = consistency_of(pairs, *alignment);
  scores.jumps = count_jumps(pairs, options);
  return scores;
}

}  // namespace waymark
