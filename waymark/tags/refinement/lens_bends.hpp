#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

namespace waymark::refinement {

/// Displacement of the print on a tag by lens distortion, relative to the homography of its four corners. It
/// is of fourth order in s and in t (along TL-TR and TR-BR, -1 to 1) and 0 at the corners.
struct LensField {
  static constexpr std::size_t kNodes = 5;  ///< -1, -1/2, 0, 1/2, 1
  /// at the nodes of s for the first node of t, then the second, …
  std::array<Eigen::Vector2d, kNodes * kNodes> off_px{};

  [[nodiscard]] Eigen::Vector2d at(double s, double t) const;
};

/// The field of the tag between these edges; nothing outside the domain of the camera model.
[[nodiscard]] std::optional<LensField> lens_field(const CameraModel& camera,
                                                  const std::array<EdgeFrame, 4>& edges);

/// Expected curvature of edges in the image. With a camera model the bulge of a straight line is computed and
/// written to EdgeFrame::bulge_px; without one (or outside its domain) it is 0. Returns the standard
/// deviation of additional curvature that the fit may estimate [px]. It is a tenth of the camera model's
/// bulge, or the sagitta of `curvature_per_px` over the length of the edge.
std::array<double, 4> expect_bends(const CameraModel* camera, double curvature_per_px,
                                   std::array<EdgeFrame, 4>& edges);

}  // namespace waymark::refinement
