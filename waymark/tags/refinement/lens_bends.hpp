#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

namespace waymark::refinement {

/// How far a lens moves what is printed on a tag from where the homography of its four corners has it:
/// of the fourth order in s and in t (along TL-TR and TR-BR, -1 to 1), 0 at the corners.
struct LensField {
  static constexpr std::size_t kNodes = 5;                ///< -1, -1/2, 0, 1/2, 1
  std::array<Eigen::Vector2d, kNodes * kNodes> off_px{};  ///< at the nodes of s, at the first of t first

  [[nodiscard]] Eigen::Vector2d at(double s, double t) const;
};

/// Of the tag between these edges; nothing where the camera model does not reach.
[[nodiscard]] std::optional<LensField> lens_field(const CameraModel& camera,
                                                  const std::array<EdgeFrame, 4>& edges);

/// How edges bend in the image. With a camera model the bulge of a straight line is computed and written to
/// EdgeFrame::bulge_px; where there is none (or it does not reach), it is 0. What comes back is how far the
/// fit may bend each edge beyond that [px, standard deviation]: a tenth of what the camera model says, or the
/// sagitta of `curvature_per_px` over the length of the edge.
std::array<double, 4> expect_bends(const CameraModel* camera, double curvature_per_px,
                                   std::array<EdgeFrame, 4>& edges);

}  // namespace waymark::refinement
