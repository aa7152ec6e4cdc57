#include "waymark/pose/homography.hpp"

#include <cmath>

#include <fmt/format.h>
#include <Eigen/SVD>

namespace waymark {
namespace {

using Points = std::span<const Eigen::Vector2d>;
using Index = Eigen::Index;

/// If a singular value or determinant is below this relative size, it is only rounding error, and the points
/// do not determine a homography.
constexpr double kDegenerate = 1e-10;

auto invalid(std::string message, std::string hint) {
  return fail(ErrorCode::InvalidArgument, std::move(message), {}, std::move(hint));
}

Status check(Points a_points, Points b_points) {
  if (a_points.size() != b_points.size()) {
    return invalid(fmt::format("{} points but {} images", a_points.size(), b_points.size()),
                   "Pass pairs: as many points in one plane as in the other.");
  }
  if (a_points.size() < 4) {
    return invalid(fmt::format("{} pairs of points do not determine a homography", a_points.size()),
                   "Pass at least 4 pairs, no three of four on one line.");
  }
  for (const Points points : {a_points, b_points}) {
    for (const Eigen::Vector2d& p : points) {
      if (!p.allFinite()) return invalid("non-finite coordinate of a point", "Check the input.");
    }
  }
  return {};
}

/// Hartley's normalisation (algorithm 4.2, steps i and ii): moves the centroid to the origin and scales the
/// mean distance to sqrt(2). Returns the zero matrix if all points coincide.
Eigen::Matrix3d normalisation(Points points) {
  const double n = static_cast<double>(points.size());
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) centroid += p / n;
  double distance = 0;
  for (const Eigen::Vector2d& p : points) distance += (p - centroid).norm() / n;
  const double scale = std::sqrt(2.0) / distance;
  if (!std::isfinite(scale) || scale == 0) return Eigen::Matrix3d::Zero();
  Eigen::Matrix3d T;
  T << scale, 0, -scale * centroid.x(), 0, scale, -scale * centroid.y(), 0, 0, 1;
  return T;
}

/// The 2n equations b x (H a) = 0, two rows per pair (Hartley and Zisserman, equation 4.3).
Eigen::Matrix<double, Eigen::Dynamic, 9> equations(Points a_points, const Eigen::Matrix3d& Ta,
                                                   Points b_points, const Eigen::Matrix3d& Tb) {
  Eigen::Matrix<double, Eigen::Dynamic, 9> A(2 * static_cast<Index>(a_points.size()), 9);
  for (std::size_t i = 0; i < a_points.size(); ++i) {
    const Eigen::RowVector3d a = (Ta * a_points[i].homogeneous()).transpose();
    const Eigen::Vector2d b = (Tb * b_points[i].homogeneous()).head<2>();
    const auto row = static_cast<Index>(2 * i);
    A.row(row) << Eigen::RowVector3d::Zero(), -a, b.y() * a;
    A.row(row + 1) << a, Eigen::RowVector3d::Zero(), -b.x() * a;
  }
  return A;
}

}  // namespace

Result<Eigen::Matrix3d> homography_dlt(Points a_points, Points b_points) {
  if (const Status status = check(a_points, b_points); !status) return tl::unexpected<Error>(status.error());
  const Eigen::Matrix3d Ta = normalisation(a_points);
  const Eigen::Matrix3d Tb = normalisation(b_points);
  const auto degenerate = [] {
    return invalid("the points do not determine a homography: they are repeated or too many lie on one line",
                   "Pass at least 4 different points, no three of four on one line.");
  };
  if (Ta.isZero(0) || Tb.isZero(0)) return degenerate();

  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(equations(a_points, Ta, b_points, Tb), Eigen::ComputeFullV);
  // If the rank is below 8, the solution is not unique; a singular solution would collapse the plane.
  if (!(svd.singularValues()(7) > kDegenerate * svd.singularValues()(0))) return degenerate();
  const Eigen::Matrix<double, 9, 1> h = svd.matrixV().col(8);
  const Eigen::Matrix3d normalised = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(h.data());
  if (!(std::abs(normalised.determinant()) > kDegenerate)) return degenerate();

  Eigen::Matrix3d b_H_a = Tb.inverse() * normalised * Ta;
  b_H_a /= b_H_a.norm();
  // When normalised, the centroid of a is (0, 0, 1).
  if (normalised(2, 2) < 0) b_H_a = -b_H_a;
  if (!b_H_a.allFinite()) return degenerate();
  return b_H_a;
}

}  // namespace waymark
