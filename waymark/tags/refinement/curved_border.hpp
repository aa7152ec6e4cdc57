#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "waymark/image/image.hpp"
#include "waymark/tags/refinement/edge_model.hpp"
#include "waymark/tags/refinement/tag_fit.hpp"

namespace waymark::refinement {

/// The border of a tag whose sides are curved because its sheet is not flat, or because the camera moved
/// while a rolling shutter read the image.
struct CurvedBorder {
  Quad corners_px{};  ///< intersections of the curved sides
  Matrix8 covariance_px2 = Matrix8::Zero();
  std::array<Eigen::Vector3d, 4> bulge_px{};  ///< of the sides between the corners, as in EdgeFrame
  double noise_px = 0;                        ///< root mean square distance of the crossings from the curves
  double contrast = 0;                        ///< [grey level] usual step across the border
  int crossings = 0;                          ///< number of places at which the border was found
};

/// Whether at least two sides are curved.
[[nodiscard]] bool is_curved(const CurvedBorder& border);

/// Moves all sides outwards, with a standard deviation that is common to them.
void move_outwards(double distance_px, double sigma_px, CurvedBorder& border);

/// Follows the border from a quad that is near it. Each side is a curve of fourth order whose bends are small
/// unless the image shows otherwise. Returns `nullopt` if a side is not visible along most of its length, or
/// if no side bulges by `least_bulge_px` [px], which the first look shows. O(length of the border); does not
/// allocate.
[[nodiscard]] std::optional<CurvedBorder> follow_border(const ImageView& image, const PrintedTag& print,
                                                        const Quad& near_px, double least_bulge_px = 0);

}  // namespace waymark::refinement
