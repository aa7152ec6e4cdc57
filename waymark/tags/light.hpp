#pragma once

#include <Eigen/Core>

#include "waymark/tags/tag_bands.hpp"

namespace waymark::refinement {

/// Light that falls off across a tag makes grey levels 1 + per_px . (px - middle) times those of even light.
/// This is what the last linearize_all() tells about per_px, where the model is flat: how residuals lean
/// along each edge. Levels that differ between the edges are not used; they have their own parameters.
struct LightInformation {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  ///< inverse covariance of per_px, prior included
  Eigen::Vector2d step_per_px{0, 0};                      ///< from where the tag was linearized to the best
};

/// Tags with few flat pixels stay near even light. O(1).
[[nodiscard]] LightInformation light_information(const TagBands& tag, const Eigen::Vector2d& light_per_px,
                                                 double noise_variance);

}  // namespace waymark::refinement
