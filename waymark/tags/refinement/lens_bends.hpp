#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

namespace waymark::refinement {

/// Displacement of the print on a tag due to lens distortion, relative to the homography given by its four
/// corners. It is of fourth order in s and t (along TL-TR and TR-BR, from -1 to 1) and 0 at the corners.
struct LensField {
  static constexpr std::size_t kNodes = 5;  ///< at -1, -1/2, 0, 1/2 and 1
  /// displacements at the nodes of s for the first node of t, then for the second, …
  std::array<Eigen::Vector2d, kNodes * kNodes> off_px{};

  [[nodiscard]] Eigen::Vector2d at(double s, double t) const;
};

/// The field for the tag between these edges; `nullopt` outside the domain of the camera model.
[[nodiscard]] std::optional<LensField> lens_field(const CameraModel& camera,
                                                  const std::array<EdgeFrame, 4>& edges);

/// Computes the expected curvature of edges in the image. With a camera model, the bulge of a straight line
/// is computed and written to EdgeFrame::bulge_px; without one (or outside its domain), the bulge is 0.
/// Returns the standard deviation of the additional curvature that the fit may estimate [px]. It is a tenth
/// of the camera model's bulge, or the sagitta that `curvature_per_px` causes over the length of the edge.
std::array<double, 4> expect_bends(const CameraModel* camera, double curvature_per_px,
                                   std::array<EdgeFrame, 4>& edges);

}  // namespace waymark::refinement
