#include "waymark/tags/straightening.hpp"

#include <algorithm>
#include <cstddef>

#include <Eigen/LU>

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;

constexpr std::array<double, 4> kNodes = {-1.0, -1.0 / 3, 1.0 / 3, 1.0};

/// Coefficients of the cubic through values at kNodes.
std::array<Vector2d, 4> cubic_through(const std::array<Vector2d, 4>& v) {
  return {(-v[0] + 9 * v[1] + 9 * v[2] - v[3]) / 16, (v[0] - 27 * v[1] + 27 * v[2] - v[3]) / 16,
          (9 * v[0] - 9 * v[1] - 9 * v[2] + 9 * v[3]) / 16,
          (-9 * v[0] + 27 * v[1] - 27 * v[2] + 9 * v[3]) / 16};
}

/// From normalised coordinates to pixels, linear about a pixel.
struct LinearCamera {
  Vector2d px, normalized;
  Eigen::Matrix2d px_J_normalized;
  [[nodiscard]] Vector2d project(const Vector2d& point) const {
    return px + px_J_normalized * (point - normalized);
  }
};

std::optional<LinearCamera> linearized(const CameraModel& camera, const Vector2d& px, double step_px) {
  const auto middle = camera.normalize(px);
  if (!middle) return std::nullopt;
  Eigen::Matrix2d J;
  for (int i = 0; i < 2; ++i) {
    const Vector2d step = step_px * Vector2d::Unit(i);
    const auto after = camera.normalize(px + step);
    const auto before = camera.normalize(px - step);
    if (!after || !before) return std::nullopt;
    J.col(i) = (*after - *before) / (2 * step_px);
  }
  if (!(std::abs(J.determinant()) > 1e-300)) return std::nullopt;
  return LinearCamera{px, *middle, J.inverse()};
}

}  // namespace

std::optional<Straightening> Straightening::of(const CameraModel& camera, const Quad& corners_px) {
  Straightening made;
  made.middle_px_ = 0.25 * (corners_px[0] + corners_px[1] + corners_px[2] + corners_px[3]);
  made.reach_px_ = 0;
  for (const Vector2d& corner : corners_px) {
    made.reach_px_ = std::max(made.reach_px_, 1.3 * (corner - made.middle_px_).cwiseAbs().maxCoeff());
  }
  const auto linear = linearized(camera, made.middle_px_, 1.0);
  if (!linear) return std::nullopt;
  std::array<std::array<Vector2d, 4>, 4> by_x;  // one row of nodes each
  for (std::size_t i = 0; i < 4; ++i) {
    std::array<Vector2d, 4> shift;
    for (std::size_t j = 0; j < 4; ++j) {
      const Vector2d px = made.middle_px_ + made.reach_px_ * Vector2d(kNodes[j], kNodes[i]);
      const auto point = camera.normalize(px);
      if (!point) return std::nullopt;
      shift[j] = linear->project(*point) - px;
    }
    by_x[i] = cubic_through(shift);
  }
  for (std::size_t j = 0; j < 4; ++j) {
    const auto by_y = cubic_through({by_x[0][j], by_x[1][j], by_x[2][j], by_x[3][j]});
    for (std::size_t i = 0; i < 4; ++i) made.by_y_x_[i][j] = by_y[i];
  }
  made.moves_ = true;
  return made;
}

Straightening::Row Straightening::row(double y_px) const {
  Row row;
  if (!moves_) return row;
  const double y = (y_px - middle_px_.y()) / reach_px_;
  for (std::size_t j = 0; j < 4; ++j) {
    row.by_x[j] = by_y_x_[0][j] + y * (by_y_x_[1][j] + y * (by_y_x_[2][j] + y * by_y_x_[3][j]));
  }
  return row;
}

Vector2d Straightening::distorted(const Vector2d& straight_px) const {
  Vector2d px = straight_px;
  for (int i = 0; moves_ && i < 6; ++i) px = straight_px - shift(px);
  return px;
}

Eigen::Matrix2d Straightening::distorted_by_straight(const Vector2d& px) const {
  if (!moves_) return Eigen::Matrix2d::Identity();
  Eigen::Matrix2d J;
  constexpr double kStepPx = 0.5;
  for (int i = 0; i < 2; ++i) {
    const Vector2d step = kStepPx * Vector2d::Unit(i);
    J.col(i) = (straight(px + step) - straight(px - step)) / (2 * kStepPx);
  }
  return J.inverse();
}

Vector2d unknown_lens_shift(const Vector2d& image_px, double curvature_per_px, const Vector2d& px) {
  const Vector2d from_middle = px - 0.5 * image_px;
  // A line at distance r, moved outwards by k r^3, bends by 2 k r.
  const double k = curvature_per_px / image_px.norm();
  return k * from_middle.squaredNorm() * from_middle;
}

}  // namespace waymark::refinement
