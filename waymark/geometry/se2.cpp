#include "waymark/geometry/se2.hpp"

#include "waymark/geometry/stumpff.hpp"

namespace waymark {

SO2::Point SO2::act(const Point& b_p, Eigen::Matrix<double, 2, 1>* J_p_R, Matrix* J_p_p) const {
  Point a_p = *this * b_p;
  if (J_p_R != nullptr) *J_p_R << -a_p.y(), a_p.x();
  if (J_p_p != nullptr) *J_p_p = matrix();
  return a_p;
}

SO2::Matrix SO2::matrix() const { return (Matrix() << cos_, -sin_, sin_, cos_).finished(); }

SO2::Matrix SO2::hat(const Tangent& xi) { return (Matrix() << 0, -xi[0], xi[0], 0).finished(); }

SE2 SE2::exp(const Tangent& xi) {
  const double s = xi[2] * xi[2];
  const Stumpff c = stumpff(s);
  const double b = xi[2] * c.c2;
  return {SO2(xi[2]), {c.c1 * xi[0] - b * xi[1], b * xi[0] + c.c1 * xi[1]}};
}

SE2::Tangent SE2::log() const {
  const double theta = yaw();
  const double half = theta / 2;
  const double a =
      1.0 - theta * theta * inverse_jacobian_coefficient(theta * theta);  // (theta/2) cot(theta/2)
  return {a * x() + half * y(), -half * x() + a * y(), theta};
}

SE2::Point SE2::act(const Point& b_p, Eigen::Matrix<double, 2, 3>* J_p_T, Eigen::Matrix2d* J_p_p) const {
  Point a_p = *this * b_p;
  if (J_p_T != nullptr) *J_p_T << 1, 0, -a_p.y(), 0, 1, a_p.x();
  if (J_p_p != nullptr) *J_p_p = rotation_.matrix();
  return a_p;
}

SE2::Matrix SE2::matrix() const {
  Matrix m = Matrix::Identity();
  m.topLeftCorner<2, 2>() = rotation_.matrix();
  m.topRightCorner<2, 1>() = translation_;
  return m;
}

SE2::Jacobian SE2::adjoint() const {
  Jacobian m = Jacobian::Identity();
  m.topLeftCorner<2, 2>() = rotation_.matrix();
  m.topRightCorner<2, 1>() << y(), -x();
  return m;
}

SE2::Jacobian SE2::ad(const Tangent& xi) {
  return (Jacobian() << 0, -xi[2], xi[1], xi[2], 0, -xi[0], 0, 0, 0).finished();
}

SE2::Matrix SE2::hat(const Tangent& xi) {
  return (Matrix() << 0, -xi[2], xi[0], xi[2], 0, xi[1], 0, 0, 0).finished();
}

SE2::Tangent SE2::vee(const Matrix& m) { return {m(0, 2), m(1, 2), (m(1, 0) - m(0, 1)) / 2}; }

SE2::Jacobian SE2::left_jacobian(const Tangent& xi) {
  const Stumpff c = stumpff(xi[2] * xi[2]);
  const Jacobian a = ad(xi);
  return Jacobian::Identity() + c.c2 * a + c.c3 * (a * a);
}

SE2::Jacobian SE2::left_jacobian_inverse(const Tangent& xi) {
  const Jacobian a = ad(xi);
  return Jacobian::Identity() - a / 2 + inverse_jacobian_coefficient(xi[2] * xi[2]) * (a * a);
}

SE2::Jacobian SE2::right_jacobian(const Tangent& xi) { return left_jacobian(-xi); }

SE2::Jacobian SE2::right_jacobian_inverse(const Tangent& xi) { return left_jacobian_inverse(-xi); }

}  // namespace waymark
