#pragma once

#include <optional>

#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/simulation/tag_camera.hpp"
#include "waymark/simulation/world.hpp"

namespace waymark {

/// What a robot meets that drives the line of a world exactly.
struct WorldCheck {
  double lap_m = 0;
  double min_clearance_m = 0;          ///< hull to the nearest tag, in space; infinite without tags
  std::optional<TagId> nearest_tag{};  ///< the one that comes nearest
  Eigen::Vector2d nearest_place_m = Eigen::Vector2d::Zero();  ///< where on the line
  double two_tags_fraction = 0;  ///< share of the line from which the camera sees two tags or more
  double one_tag_fraction = 0;   ///< … one or more
  std::size_t fewest_tags = 0;   ///< in view anywhere on the line
  double sharpest_left_1_m = 0;  ///< largest curvature to the left, 0 when there is none
  double sharpest_right_1_m = 0;
};

/// Drives along the line in steps of 2 cm without noise and looks. A tag is seen when visible_corners() and
/// the range of the simulated camera say so. Fails on a world without a line. O(length · tags).
[[nodiscard]] Result<WorldCheck> check_world(const World& world, const RobotModel& robot,
                                             const CameraModel& camera, const TagCameraOptions& options = {});

}  // namespace waymark
