#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/simulation/tag_camera.hpp"
#include "waymark/simulation/world.hpp"

namespace waymark {

/// A tag that the camera would see, did not the paper of another cover a part of it. Where
/// World::corners_through_paper the corner camera sees it all the same.
struct HiddenTag {
  TagId tag{};
  TagId by{};
  double from_m = 0;  ///< of the line
};

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
  std::vector<std::pair<TagId, TagId>> overlapping{};  ///< tags of which one lies on the other, or cuts it
  std::vector<HiddenTag> hidden{};
};

/// Drives along the line in steps of 2 cm without noise and looks. A tag is seen when visible_corners() and
/// the range of the simulated camera say so, and nothing hides it. Fails on a world without a line.
/// O(tags² + length · (tags + tags in view · tags)).
[[nodiscard]] Result<WorldCheck> check_world(const World& world, const RobotModel& robot,
                                             const CameraModel& camera, const TagCameraOptions& options = {});

}  // namespace waymark
