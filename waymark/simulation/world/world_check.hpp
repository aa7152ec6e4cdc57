#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/simulation/sensors/tag_camera.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {

/// A tag that would be in view if the paper of another did not cover part of it. With
/// World::corners_through_paper the corner camera detects it anyway.
struct HiddenTag {
  TagId tag{};
  TagId by{};
  double from_m = 0;  ///< along the line
};

/// Results for a robot that drives the line of a world exactly.
struct WorldCheck {
  double lap_m = 0;
  double min_clearance_m = 0;          ///< from the hull to the nearest tag, in space; infinite without tags
  std::optional<TagId> nearest_tag{};  ///< the tag with the smallest distance
  Eigen::Vector2d nearest_place_m = Eigen::Vector2d::Zero();  ///< its position on the line
  double two_tags_fraction = 0;  ///< fraction of the line from which the camera sees two or more tags
  double one_tag_fraction = 0;   ///< … one or more tags
  std::size_t fewest_tags = 0;   ///< smallest number of tags in view on the line
  double sharpest_left_1_m = 0;  ///< largest curvature to the left, 0 if there is none
  double sharpest_right_1_m = 0;
  /// pairs of tags of which one overlaps or intersects the other
  std::vector<std::pair<TagId, TagId>> overlapping{};
  std::vector<HiddenTag> hidden{};
};

/// Drives along the line in steps of 2 cm without noise. A tag is in view if visible_corners() and the range
/// of the simulated camera accept it, and nothing hides it. Fails on a world without a line. O(tags² + length
/// · (tags + tags in view · tags)).
[[nodiscard]] Result<WorldCheck> check_world(const World& world, const RobotModel& robot,
                                             const CameraModel& camera, const TagCameraOptions& options = {});

struct OrbitOptions {
  std::uint64_t seed = 1;
  int steps = 360;
  double sigma_m = 0.005;
  double sigma_deg = 0.5;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.seed, Field{"seed", "Random seed of the noise.", 0});
    visit(self.steps, Field{"steps", "Number of poses on the circle.", 8, 100000});
    visit(self.sigma_m, Field{"sigma_m", "Standard deviation of each coordinate of camera and tags.", 0, 10});
    visit(self.sigma_deg,
          Field{"sigma_deg", "Standard deviation of each rotation of camera and tags.", 0, 180});
  }
};

/// Result of a camera's orbit around the tags, which checks the frame conventions.
struct OrbitReport {
  double radius_m = 0;
  Eigen::Vector3d map_t_center = Eigen::Vector3d::Zero();
  std::vector<SE3> map_T_cam{};           ///< nominal
  std::vector<SE3> map_T_cam_composed{};  ///< through the anchor (equation 3.1), with noise
  TagMap tags_composed{};                 ///< through anchor and camera, with the noise of the last step

  /// Without noise: largest |log| of transforms that should be the identity. These are the camera through the
  /// anchor, every tag through the camera, the motions around the circle, and the steps from tag to tag and
  /// back.
  double closure = 0;

  /// With noise: a jump is the motion of a composed frame from one step to the next, minus the nominal one.
  /// The limits are six standard deviations of the expected noise.
  double jump_m = 0, jump_limit_m = 0;
  double jump_deg = 0, jump_limit_deg = 0;
  double smallest_axis_cosine = 1;  ///< between an axis of a composed frame and the nominal one

  [[nodiscard]] bool closes() const { return closure < 1e-12; }
  [[nodiscard]] bool continuous() const { return jump_m <= jump_limit_m && jump_deg <= jump_limit_deg; }
  [[nodiscard]] bool upright() const { return smallest_axis_cosine > 0; }
};

/// Evaluates numerically the validation view of Martins and Ramos, "AprilTag-based Trajectory Tracking for
/// the LIMOS Robot", section 3.1. A nominal camera moves on a circle about the tags and faces their centre.
/// Each pose of camera and tags is used without noise and with noise in its own frame. Fails on a world
/// without tags and on options outside their ranges. O(steps · tags).
[[nodiscard]] Result<OrbitReport> orbit(const World& world, const OrbitOptions& options = {});

}  // namespace waymark
