#pragma once

#include <Eigen/Core>

#include "waymark/families/family.hpp"
#include "waymark/image/image.hpp"
#include "waymark/tags/tag_bands.hpp"
#include "waymark/tags/tag_fit.hpp"

namespace waymark::refinement {

/// What the bits inside the border say about the places of the border edges: by how much (kFrom, kTo) of the
/// four edges have to be moved outwards [px], and the covariance of that.
struct EdgeCorrection {
  Eigen::Matrix<double, 8, 1> outwards_px = Eigen::Matrix<double, 8, 1>::Zero();
  Eigen::Matrix<double, 8, 8> covariance_px2 = Eigen::Matrix<double, 8, 8>::Zero();
  double worst_sigmas =
      0;  ///< distance of an edge from where the bits alone would have it, over its deviation
};

/// Corrects the edges of `estimate` for what a border alone cannot tell from its place: white that reaches
/// into black (gamma, bloom, ink) and grey levels that grow along an edge (shadow, veil, uneven light). White
/// that grows moves an edge one way where white lies left of black, and the other way where it lies right of
/// it, so the bits between show it. Each of the two is there or is not (Hoeting et al., "Bayesian model
/// averaging: a tutorial", 1999). O(pixels), at most some hundred; no allocation.
[[nodiscard]] EdgeCorrection inner_correction(const ImageView& image, const TagId& id, const TagBands& tag,
                                              const TagEstimate& estimate);

}  // namespace waymark::refinement
