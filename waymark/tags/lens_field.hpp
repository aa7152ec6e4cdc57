#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/tags/edge_band.hpp"

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

}  // namespace waymark::refinement
