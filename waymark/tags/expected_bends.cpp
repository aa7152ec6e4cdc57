#include "waymark/tags/expected_bends.hpp"

#include <cstddef>
#include <optional>

#include <Eigen/LU>

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;

/// The bulge an image of a straight line shows between two corners, from three points on it; nothing where
/// the camera model does not reach.
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
  constexpr double kDoubtInDistortion = 0.1;
  std::array<double, 4> sigma_px{};
  for (std::size_t k = 0; k < 4; ++k) {
    const auto known = camera == nullptr ? std::nullopt : bulge_px(*camera, edges[k]);
    edges[k].bulge_px = known.value_or(Eigen::Vector3d::Zero());
    sigma_px[k] = known ? kDoubtInDistortion * edges[k].bulge_px.cwiseAbs().maxCoeff()
                        : curvature_per_px * edges[k].length_px * edges[k].length_px / 8.0;
  }
  return sigma_px;
}

}  // namespace waymark::refinement
