#include "waymark/tags/light.hpp"

#include <cstddef>

#include <Eigen/LU>

namespace waymark::refinement {

// Along an edge with half span e, light has 1 + t per_px . e, t from -1 to 1. Linear least squares over the
// flat pixels of all edges: residual = predicted t (per_px . e).
LightInformation light_information(const TagBands& tag, const Eigen::Vector2d& light_per_px,
                                   double noise_variance) {
  constexpr double kUsualPerPx = 0.00025;  // a VGA image a sixth brighter at one side than at the other
  constexpr double kPrior = 1.0 / (kUsualPerPx * kUsualPerPx);
  LightInformation light;
  light.information = kPrior * Eigen::Matrix2d::Identity();
  Eigen::Vector2d gradient = -kPrior * light_per_px;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d half_span = 0.5 * (tag.edges[k].to - tag.edges[k].from);
    light.information +=
        tag.normals[k].light_information / noise_variance * half_span * half_span.transpose();
    gradient += tag.normals[k].light_gradient / noise_variance * half_span;
  }
  light.step_per_px = light.information.inverse() * gradient;
  return light;
}

}  // namespace waymark::refinement
