#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/tag_map.hpp"

/// Computes which tags a camera sees from a pose, and how far they are from the robot's hull.
namespace waymark {

/// Conditions under which a detector finds a tag.
struct VisibilityLimits {
  double min_side_px = 14;         ///< shortest side of the quad in the image
  double max_incidence_rad = 1.3;  ///< angle between the line of sight and the tag's normal (75 deg)
  double margin_px = 2;            ///< distance from every corner to the edge of the image
};

/// The corners of a tag in its own frame [m]: TL TR BR BL, z = 0.
[[nodiscard]] std::array<Eigen::Vector3d, 4> tag_corners(double size_m);

/// Corners of a tag in the image [px], TL TR BR BL. Empty if the tag faces away, is behind the camera, too
/// oblique or too small, or is not entirely in the image. Occlusion is ignored.
[[nodiscard]] std::optional<std::array<Eigen::Vector2d, 4>> visible_corners(
    const CameraModel& camera, const SE3& cam_T_tag, double size_m, const VisibilityLimits& limits = {});

/// The map tags that the camera sees, ordered by id. O(tags).
[[nodiscard]] std::vector<TagId> visible_tags(const TagMap& map, const CameraModel& camera,
                                              const SE3& map_T_cam, const VisibilityLimits& limits = {});

/// Shortest distance in space between the hull's box and the black square of a tag [m]; 0 if they touch.
/// Computed by alternating projections between two convex sets (Cheney and Goldstein, "Proximity maps for
/// convex sets", Proc. AMS 10, 1959).
[[nodiscard]] double clearance_m(const Hull& hull, const SE3& map_T_base, const MappedTag& tag);

/// The clearance to the nearest tag in a map; infinite for an empty map. O(tags).
[[nodiscard]] double clearance_m(const Hull& hull, const SE3& map_T_base, const TagMap& map);

}  // namespace waymark
