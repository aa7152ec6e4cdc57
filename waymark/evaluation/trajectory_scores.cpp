#include "waymark/evaluation/trajectory_scores.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "waymark/base/angles.hpp"
#include "waymark/evaluation/driven_path.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {

ErrorStatistics statistics_of(std::vector<double> errors) {
  if (errors.empty()) return {};
  for (double& error : errors) error = std::abs(error);
  std::ranges::sort(errors);
  const auto n = static_cast<double>(errors.size());
  const auto quantile = [&](double share) {  // linear between ranks, as in numpy.percentile
    const double rank = share * (n - 1);
    const auto below = static_cast<std::size_t>(rank);
    const std::size_t above = std::min(below + 1, errors.size() - 1);
    const double u = rank - static_cast<double>(below);
    return (1 - u) * errors[below] + u * errors[above];
  };
  return {.count = errors.size(),
          .rmse = std::sqrt(std::inner_product(errors.begin(), errors.end(), errors.begin(), 0.0) / n),
          .mean = std::accumulate(errors.begin(), errors.end(), 0.0) / n,
          .median = quantile(0.5),
          .p95 = quantile(0.95),
          .max = errors.back()};
}

namespace {

using Positions = Eigen::Matrix<double, 3, Eigen::Dynamic>;
constexpr std::array<std::pair<AlignmentKind, std::string_view>, 4> kAlignmentNames = {
    {{AlignmentKind::None, "none"},
     {AlignmentKind::Se2, "se2"},
     {AlignmentKind::Se3, "se3"},
     {AlignmentKind::Sim3, "sim3"}}};

/// Spread of the positions along their second-widest direction [m] or, for se2, along the widest direction in
/// the floor plane. Without spread, a rotation is not observable.
double decisive_spread_m(const Positions& p, AlignmentKind kind) {
  Positions centred = p.colwise() - p.rowwise().mean();
  if (kind == AlignmentKind::Se2) centred.row(2).setZero();
  const Eigen::Matrix3d scatter = centred * centred.transpose() / static_cast<double>(p.cols());
  const Eigen::Vector3d variances = Eigen::JacobiSVD<Eigen::Matrix3d>(scatter).singularValues();
  return std::sqrt(variances[kind == AlignmentKind::Se2 ? 0 : 1]);
}

Alignment align_in_plane(const Positions& estimated, const Positions& reference) {
  const Eigen::Matrix3d fit =
      Eigen::umeyama(estimated.topRows<2>().eval(), reference.topRows<2>().eval(), false);
  const double yaw_rad = std::atan2(fit(1, 0), fit(0, 0));
  return {1, SE3(SO3::exp({0, 0, yaw_rad}), {fit(0, 2), fit(1, 2), 0})};
}

Alignment align_in_space(const Positions& estimated, const Positions& reference, bool with_scale) {
  const Eigen::Matrix4d fit = Eigen::umeyama(estimated, reference, with_scale);
  const double scale = fit.topLeftCorner<3, 1>().norm();
  const Eigen::Matrix3d rotation = fit.topLeftCorner<3, 3>() / scale;
  return {scale, SE3(SO3::from_matrix(rotation), fit.topRightCorner<3, 1>())};
}

}  // namespace

std::string_view to_string(AlignmentKind kind) {
  for (const auto& [known, name] : kAlignmentNames)
    if (known == kind) return name;
  return "";
}

std::optional<AlignmentKind> alignment_kind(std::string_view word) {
  for (const auto& [kind, name] : kAlignmentNames)
    if (name == word) return kind;
  return std::nullopt;
}

Result<Alignment> align(const std::vector<PosePair>& pairs, AlignmentKind kind) {
  constexpr std::size_t kMinPairs = 3;
  constexpr double kLeastSpread = 1e-3;
  if (kind == AlignmentKind::None) return Alignment{};
  if (pairs.size() < kMinPairs)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} poses at the times of the reference are too few to align", pairs.size()));
  Positions estimated(3, static_cast<Eigen::Index>(pairs.size()));
  Positions reference(3, estimated.cols());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    estimated.col(static_cast<Eigen::Index>(i)) = pairs[i].estimated.map_T_base.translation();
    reference.col(static_cast<Eigen::Index>(i)) = pairs[i].reference.translation();
  }
  if (decisive_spread_m(estimated, kind) < kLeastSpread || decisive_spread_m(reference, kind) < kLeastSpread)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the positions spread too little for the alignment {}", to_string(kind)), {},
                kind == AlignmentKind::Se2 ? "Use a longer drive, or the alignment none."
                                           : "They lie on a line; use the alignment se2 or none.");
  return kind == AlignmentKind::Se2 ? align_in_plane(estimated, reference)
                                    : align_in_space(estimated, reference, kind == AlignmentKind::Sim3);
}

namespace {

/// One side of the path, with its start, direction (a unit vector) and length.
struct Side {
  Eigen::Vector2d begin{};
  Eigen::Vector2d along{};
  double length_m = 0;
};

std::vector<Side> sides_of(const FloorPath& path) {
  std::vector<Side> sides;
  const std::size_t n = path.corners.size();
  for (std::size_t i = 0; i + (path.closed ? 0 : 1) < n; ++i) {
    const Eigen::Vector2d way = path.corners[(i + 1) % n] - path.corners[i];
    if (way.norm() > 0) sides.push_back({path.corners[i], way.normalized(), way.norm()});
  }
  return sides;
}

double distance_m(const Side& side, const Eigen::Vector2d& p) {
  const double foot = std::clamp((p - side.begin).dot(side.along), 0.0, side.length_m);
  return (p - side.begin - foot * side.along).norm();
}

double left_of_m(const Side& side, const Eigen::Vector2d& p) {
  const Eigen::Vector2d r = p - side.begin;
  return side.along.x() * r.y() - side.along.y() * r.x();
}

double nearest_m(const std::vector<Side>& sides, const Eigen::Vector2d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Side& side : sides) nearest = std::min(nearest, distance_m(side, p));
  return nearest;
}

/// The side whose direction is closest to the heading of the robot; the nearest one if several are equally
/// close.
const Side& side_driven(const std::vector<Side>& sides, const SE2& map_T_base) {
  constexpr double kAlike = 1e-3;
  const Eigen::Vector2d ahead(std::cos(map_T_base.yaw()), std::sin(map_T_base.yaw()));
  const Eigen::Vector2d& p = map_T_base.translation();
  const Side* best = &sides.front();
  for (const Side& side : sides) {
    const double gain = side.along.dot(ahead) - best->along.dot(ahead);
    if (gain > kAlike || (gain > -kAlike && distance_m(side, p) < distance_m(*best, p))) best = &side;
  }
  return *best;
}

}  // namespace

std::optional<PathScores> score_path(const EstimatedTrajectory& estimated, const FloorPath& path) {
  const std::vector<Side> sides = sides_of(path);
  if (sides.empty() || estimated.empty()) return std::nullopt;
  std::vector<double> distances;
  std::vector<double> from_side;
  double sum = 0;
  for (const EstimatedPose& estimate : estimated) {
    const SE2 map_T_base = project_to_plane(estimate.map_T_base);
    distances.push_back(nearest_m(sides, map_T_base.translation()));
    from_side.push_back(left_of_m(side_driven(sides, map_T_base), map_T_base.translation()));
    sum += from_side.back();
  }
  const double mean = sum / static_cast<double>(estimated.size());
  return PathScores{statistics_of(std::move(distances)), statistics_of(std::move(from_side)), mean};
}

FloorPath floor_path(const Trajectory& trajectory, double step_m) {
  FloorPath path;
  for (const internal::PathPose& pose : internal::driven_path(trajectory, step_m))
    path.corners.push_back(pose.map_p);
  return path;
}

namespace {

Duration duration_of(double seconds) { return Duration(std::llround(seconds * 1e9)); }

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

/// Error of the estimate in x, y and yaw after alignment.
Eigen::Vector3d planar_error(const PosePair& pair, const Alignment& alignment) {
  const SE2 estimated = project_to_plane(alignment(pair.estimated.map_T_base));
  const SE2 reference = project_to_plane(pair.reference);
  return {estimated.x() - reference.x(), estimated.y() - reference.y(),
          wrapped(estimated.yaw() - reference.yaw())};
}

/// The covariance of the aligned estimate, whose position part is rotated and scaled like the estimate.
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

/// The error of the motion from pair i to pair j, in the base frame at i.
SE3 motion_error(const PosePair& i, const PosePair& j, double scale) {
  SE3 estimated = i.estimated.map_T_base.inverse() * j.estimated.map_T_base;
  estimated = SE3(estimated.rotation(), scale * estimated.translation());
  return (i.reference.inverse() * j.reference).inverse() * estimated;
}

/// Position of each pair along the axis used for relative errors: time [s], or path length of the reference
/// [m].
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
    return fail(ErrorCode::NotFound, "no estimate is within the time of the reference", {},
                "Check that both are of the same drive and on the same clock.");
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
