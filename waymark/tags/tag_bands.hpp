#pragma once

#include <array>
#include <optional>

#include "waymark/tags/edge_model.hpp"
#include "waymark/tags/lens_field.hpp"

namespace waymark::refinement {

/// The four edges of one tag and the pixels around them. Some 250 kB, meant for the stack of one call; only
/// what the tag needs of it is touched.
struct TagBands {
  std::array<EdgeFrame, 4> edges;
  std::array<Band, 4> bands;
  std::array<SliceCosts, 4> costs;  ///< of the last linearize() of each band
  std::array<NormalEquations, 4> normals;
  int pixels = 0;                   ///< of all bands
  std::optional<LensField> lens{};  ///< of a known lens, between these edges
};

/// Reads the bands around `edges`. The first pass looks wider and at fewer slices: it only has to find the
/// place. False when an edge shows too few pixels.
[[nodiscard]] bool read_bands(const ImageView& image, const std::array<Surroundings, 4>& near, double blur_px,
                              bool first_pass, TagBands& tag);

/// Median grey level of the innermost (or outermost) pixels of all slices.
[[nodiscard]] double level_at_rim(const TagBands& tag, bool outermost);

/// Linearizes the model of each band at `edges`, in light that grows by `light_per_px`; the sum of weighted
/// squared residuals.
double linearize_all(const std::array<EdgeVector, 4>& edges, const Eigen::Vector2d& light_per_px,
                     TagBands& tag);

/// What drop_outliers() did.
struct DroppedSlices {
  int pixels = 0;
  bool enough_left = true;
};

/// Gives weight 0 to slices whose residual is out of all proportion to that of most others: something covers
/// the edge there. Uses `costs`.
[[nodiscard]] DroppedSlices drop_outliers(TagBands& tag);

}  // namespace waymark::refinement
