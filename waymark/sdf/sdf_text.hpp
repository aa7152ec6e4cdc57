#pragma once
// Inside the room: pieces of SDF as text. Lengths in metres, angles in radians, as SDF has them.

#include <string>
#include <string_view>

#include <Eigen/Core>

#include "waymark/geometry/se3.hpp"

namespace waymark::sdf_text {

/// "x y z roll pitch yaw"
[[nodiscard]] std::string pose(const SE3& pose);
[[nodiscard]] std::string box(const Eigen::Vector3d& size_m);
/// A colour as grey, which gives back this share of the light.
[[nodiscard]] std::string grey(double reflectance);
/// A collision and a visual of one shape.
[[nodiscard]] std::string solid(std::string_view name, const SE3& link_T_solid, std::string_view geometry,
                                double reflectance);
/// A model of one link that never moves.
[[nodiscard]] std::string fixed_model(std::string_view name, const SE3& world_T_model,
                                      std::string_view content);

}  // namespace waymark::sdf_text
