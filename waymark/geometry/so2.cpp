#include "waymark/geometry/so2.hpp"

namespace waymark {

SO2::Point SO2::act(const Point& b_p, Eigen::Matrix<double, 2, 1>* J_p_R, Matrix* J_p_p) const {
  Point a_p = *this * b_p;
  if (J_p_R != nullptr) *J_p_R << -a_p.y(), a_p.x();
  if (J_p_p != nullptr) *J_p_p = matrix();
  return a_p;
}

SO2::Matrix SO2::matrix() const { return (Matrix() << cos_, -sin_, sin_, cos_).finished(); }

SO2::Matrix SO2::hat(const Tangent& xi) { return (Matrix() << 0, -xi[0], xi[0], 0).finished(); }

}  // namespace waymark
