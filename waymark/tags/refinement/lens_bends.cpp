#include "waymark/tags/refinement/lens_bends.hpp"

#include <cstddef>
#include <optional>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace waymark::refinement {
namespace {

/// Lagrange polynomials for the nodes.
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

namespace {

using Eigen::Vector2d;

/// The bulge of the image of a straight line between two corners, computed from three points on the line;
/// `nullopt` outside the domain of the camera model.
std::optional<Eigen::Vector3d> bulge_px(const CameraModel& camera, const EdgeFrame& edge) {
  const auto a = camera.normalize(edge.from);
  const auto b = camera.normalize(edge.to);
  if (!a || !b) return std::nullopt;
  const Vector2d chord = edge.to - edge.from;
  Eigen::Matrix3d shape;
  Eigen::Vector3d bulge;
  for (int i = 0; i < 3; ++i) {
    const double share = 0.25 * (i + 1);
    const Vector2d between = (1.0 - share) * *a + share * *b;
    const auto px = camera.project({between.x(), between.y(), 1.0});
    if (!px) return std::nullopt;
    const double t = 2.0 * chord.dot(*px - edge.from) / chord.squaredNorm() - 1.0;
    shape.row(i) = (1.0 - t * t) * Eigen::RowVector3d(1.0, t, t * t);
    bulge[i] = edge.normal.dot(*px - edge.from);
  }
  const Eigen::Vector3d coefficients = shape.inverse() * bulge;
  if (!coefficients.allFinite()) return std::nullopt;
  return coefficients;
}

}  // namespace

std::array<double, 4> expect_bends(const CameraModel* camera, double curvature_per_px,
                                   std::array<EdgeFrame, 4>& edges) {
  constexpr double kDistortionSigma = 0.1;
  std::array<double, 4> sigma_px{};
  for (std::size_t k = 0; k < 4; ++k) {
    const auto known = camera == nullptr ? std::nullopt : bulge_px(*camera, edges[k]);
    edges[k].bulge_px = known.value_or(Eigen::Vector3d::Zero());
    sigma_px[k] = known ? kDistortionSigma * edges[k].bulge_px.cwiseAbs().maxCoeff()
                        : curvature_per_px * edges[k].length_px * edges[k].length_px / 8.0;
  }
  return sigma_px;
}

namespace {

using Row = Eigen::Array<double, 1, 1>;

Vector2d displacement_px(const RadialField& field, const Vector2d& px) {
  const Vector2d u = (px - field.middle_px) / field.side_px;
  const auto off = field.at(Row(u.x()), Row(u.y()));
  return {off[0][0], off[1][0]};
}

/// The infinitesimal homography with the coefficients of RadialField, at u.
Eigen::Matrix<double, 2, 8> homography_terms(const Vector2d& u) {
  Eigen::Matrix<double, 2, 8> terms;
  terms << 1, 0, u.x(), u.y(), 0, 0, u.x() * u.x(), u.x() * u.y(),  //
      0, 1, 0, 0, u.x(), u.y(), u.x() * u.y(), u.y() * u.y();
  return terms;
}

/// The derivatives of the radial part with respect to g and k, at u.
Eigen::Matrix<double, 2, 3> radial_terms(const Vector2d& u) {
  Eigen::Matrix<double, 2, 3> terms;
  terms << u.squaredNorm() * Eigen::Matrix2d::Identity(), u.squaredNorm() * u;
  return terms;
}

}  // namespace

RadialField radial_field(const std::array<EdgeFrame, 4>& edges, const std::array<double, 4>& bend_px) {
  RadialField field;
  field.middle_px = 0.25 * (edges[0].from + edges[1].from + edges[2].from + edges[3].from);
  field.side_px = 0.25 * (edges[0].length_px + edges[1].length_px + edges[2].length_px + edges[3].length_px);
  const auto unit = [&](const Vector2d& px) -> Vector2d { return (px - field.middle_px) / field.side_px; };
  Eigen::Matrix<double, 8, 8> homography;
  Eigen::Matrix<double, 8, 3> radial;
  for (Eigen::Index k = 0; k < 4; ++k) {
    const Vector2d corner = unit(edges[static_cast<std::size_t>(k)].from);
    homography.middleRows<2>(2 * k) = homography_terms(corner);
    radial.middleRows<2>(2 * k) = radial_terms(corner);
  }
  const Eigen::Matrix<double, 8, 3> by_radial = homography.partialPivLu().solve(radial);
  Eigen::Matrix<double, 4, 3> bulge;
  for (Eigen::Index k = 0; k < 4; ++k) {
    const EdgeFrame& edge = edges[static_cast<std::size_t>(k)];
    const Vector2d u = unit(0.5 * (edge.from + edge.to));
    bulge.row(k) = edge.normal.transpose() * (radial_terms(u) - homography_terms(u) * by_radial);
  }
  const Eigen::Matrix3d normal =
      bulge.transpose() * bulge + 1e-6 * bulge.squaredNorm() * Eigen::Matrix3d::Identity();
  field.radial_px =
      normal.inverse() * (bulge.transpose() * Eigen::Map<const Eigen::Vector4d>(bend_px.data()));
  field.homography_px = by_radial * field.radial_px;
  if (!field.radial_px.allFinite() || !field.homography_px.allFinite()) return {};
  return field;
}

double bulge_px(const RadialField& field, const EdgeFrame& edge) {
  return edge.normal.dot(displacement_px(field, 0.5 * (edge.from + edge.to)));
}

}  // namespace waymark::refinement
