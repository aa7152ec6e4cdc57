#include "waymark/tags/lens_field.hpp"

#include <cstddef>

#include <Eigen/Geometry>

namespace waymark::refinement {
namespace {

/// Lagrange's polynomials of the nodes.
std::array<double, LensField::kNodes> weights(double at) {
  const double square = at * at;
  const double outer = (square - 0.25) / 1.5;
  const double inner = (1 - square) / 0.375;
  return {outer * (square - at), inner * (square - 0.5 * at), (square - 1) * (4 * square - 1),
          inner * (square + 0.5 * at), outer * (square + at)};
}

}  // namespace

Eigen::Vector2d LensField::at(double s, double t) const {
  const auto along = weights(s);
  const auto down = weights(t);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t row = 0; row < kNodes; ++row)
    for (std::size_t column = 0; column < kNodes; ++column)
      sum += down[row] * along[column] * off_px[kNodes * row + column];
  return sum;
}

std::optional<LensField> lens_field(const CameraModel& camera, const std::array<EdgeFrame, 4>& edges) {
  Quad px;
  Quad plane;
  for (std::size_t k = 0; k < 4; ++k) {
    px[k] = edges[k].from;
    const auto normalized = camera.normalize(px[k]);
    if (!normalized) return std::nullopt;
    plane[k] = *normalized;
  }
  const Eigen::Matrix3d px_H_unit = homography_of_unit_square(px);
  const Eigen::Matrix3d plane_H_unit = homography_of_unit_square(plane);
  LensField field;
  for (std::size_t i = 0; i < field.off_px.size(); ++i) {
    const std::size_t row = i / LensField::kNodes;
    const std::size_t column = i % LensField::kNodes;
    const Eigen::Vector3d unit(0.25 * static_cast<double>(column), 0.25 * static_cast<double>(row), 1);
    const Eigen::Vector2d seen = (plane_H_unit * unit).hnormalized();
    const auto there = camera.project({seen.x(), seen.y(), 1});
    if (!there) return std::nullopt;
    field.off_px[i] = *there - (px_H_unit * unit).hnormalized();
    if (!field.off_px[i].allFinite()) return std::nullopt;
  }
  return field;
}

}  // namespace waymark::refinement
