#include "waymark/pose/square_pose.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

namespace waymark {
namespace {

using Bearings = std::array<Eigen::Vector3d, 4>;

/// Four corners within this angle [rad] of each other count as one point, because below it the differences
/// between unit vectors lose their precision.
constexpr double kSmallestAngle = 1e-7;
/// Smallest area of a triangle of corners, relative to the square of the longest side or diagonal. For three
/// collinear corners that are rounded to float, it is less than a millionth.
constexpr double kSmallestArea = 1e-6;

/// det(a, b, c) computed from differences, which preserves precision for small triangles.
double triple(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return a.dot((b - a).cross(c - a));
}

/// Relative depths of the corners along their bearings, equation (5).
Eigen::Vector4d corner_depths(const Bearings& q) {
  return {triple(q[1], q[2], q[3]), triple(q[0], q[2], q[3]), triple(q[0], q[1], q[3]),
          triple(q[0], q[1], q[2])};
}

QuadDefect find_defect(const Bearings& q, const Eigen::Vector4d& depths) {
  double longest = 0, shortest = 4;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = i + 1; j < 4; ++j) {
      const double squared = (q[i] - q[j]).squaredNorm();
      longest = std::max(longest, squared);
      shortest = std::min(shortest, squared);
    }
  }
  const bool one_point = !(longest > kSmallestAngle * kSmallestAngle);
  if (one_point || shortest <= kSmallestArea * kSmallestArea * longest) return QuadDefect::RepeatedCorner;
  if (depths.cwiseAbs().minCoeff() <= kSmallestArea * longest) return QuadDefect::Collinear;
  if (depths.minCoeff() > 0) return QuadDefect::None;
  return depths.maxCoeff() < 0 ? QuadDefect::Mirrored : QuadDefect::NotConvex;
}

/// Two unit vectors that complete a third one to a right-handed basis (e1, e2, z) (Duff et al., "Building an
/// Orthonormal Basis, Revisited", JCGT 6(1), 2017).
std::pair<Eigen::Vector3d, Eigen::Vector3d> complete_basis(const Eigen::Vector3d& z) {
  const double sign = std::copysign(1.0, z.z());
  const double a = -1.0 / (sign + z.z());
  const double b = z.x() * z.y() * a;
  return {Eigen::Vector3d(1.0 + sign * z.x() * z.x() * a, sign * b, -sign * z.x()),
          Eigen::Vector3d(b, sign + z.y() * z.y() * a, -z.y())};
}

/// The rotation of the square as determined by its image near the centre: R~ = [top; row], where the sign of
/// row is undetermined.
struct FirstOrder {
  double gamma = 0;     ///< largest singular value of A: half the side over the distance
  Eigen::Matrix2d top;  ///< A / gamma
  Eigen::Vector2d row;  ///< last row of the first two columns
};

/// Equations (8) and (9). A is decomposed as A z = (u z + w conj(z)) / 2 with complex u and w, so the
/// singular values are (|u| +- |w|) / 2. Their difference |w| is computed without cancellation. This
/// preserves precision for a frontal square, whose singular values are equal.
FirstOrder first_order(const Eigen::Matrix2d& A) {
  const std::complex<double> u(A(0, 0) + A(1, 1), A(1, 0) - A(0, 1));
  const std::complex<double> w(A(0, 0) - A(1, 1), A(1, 0) + A(0, 1));
  const double sum = std::abs(u), difference = std::abs(w);
  const double gamma = (sum + difference) / 2;
  const double length = std::sqrt(sum * difference) / gamma;  // sqrt(1 - (s2 / s1)^2)
  // The right singular vector for s1 has half the angle of w conj(u); the one for s2 is perpendicular to it.
  const std::complex<double> v = difference > 0 ? std::sqrt(w * std::conj(u) / (sum * difference)) : 0;
  return {gamma, A / gamma, length * Eigen::Vector2d(-v.imag(), v.real())};
}

SO3 rotation_from_columns(const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
  Eigen::Matrix3d R;
  R << x, y, x.cross(y);
  return SO3::from_quaternion(Eigen::Quaterniond(R));
}

}  // namespace

const char* to_string(QuadDefect defect) {
  switch (defect) {
    case QuadDefect::None:
      return "the corners are those of a square";
    case QuadDefect::RepeatedCorner:
      return "two corners coincide";
    case QuadDefect::Collinear:
      return "three corners are collinear";
    case QuadDefect::Mirrored:
      return "the corners are in counter-clockwise order, as if the tag was seen from behind";
    case QuadDefect::NotConvex:
      return "the corners do not form a convex quadrilateral in the order TL, TR, BR, BL";
  }
  return "";
}

SquarePoses square_poses(const Bearings& cam_bearings, double size_m) {
  const Bearings& q = cam_bearings;
  const Eigen::Vector4d depth = corner_depths(q);
  SquarePoses poses{.defect = find_defect(q, depth)};
  if (poses.defect != QuadDefect::None) return poses;

  // Columns of the homography from the square [-1, 1] x [-1, 1], equation (6). The direction to the image of
  // (x, y) is c + x a + y b.
  const Eigen::Vector3d p0 = depth[0] * q[0], p1 = depth[1] * q[1], p2 = depth[2] * q[2],
                        p3 = depth[3] * q[3];
  const Eigen::Vector3d c = p0 + p1 + p2 + p3;
  const double length = c.norm();
  const Eigen::Vector3d a = (p1 + p2 - p0 - p3) / length;
  const Eigen::Vector3d b = (p2 + p3 - p0 - p1) / length;

  // As seen along the direction to the centre, equations (7) to (9).
  const Eigen::Vector3d e3 = c / length;
  const auto [e1, e2] = complete_basis(e3);
  const Eigen::Matrix2d A = (Eigen::Matrix2d() << e1.dot(a), e1.dot(b), e2.dot(a), e2.dot(b)).finished();
  const auto [gamma, top, first_row] = first_order(A);
  Eigen::Vector2d row = first_row;
  // Equation (11): things farther away appear smaller.
  if (row.x() * e3.dot(a) + row.y() * e3.dot(b) < 0) row = -row;

  const Eigen::Vector3d cam_t_tag = size_m / (2 * gamma) * e3;  // equation (10)
  for (SE3& cam_T_tag : poses.cam_T_tag) {
    const Eigen::Vector3d x = top(0, 0) * e1 + top(1, 0) * e2 + row.x() * e3;
    const Eigen::Vector3d y = top(0, 1) * e1 + top(1, 1) * e2 + row.y() * e3;
    cam_T_tag = SE3(rotation_from_columns(x, y), cam_t_tag);
    row = -row;
  }
  return poses;
}

}  // namespace waymark
