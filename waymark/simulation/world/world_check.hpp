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

/// A tag that would be in view if it were not partly covered by the paper of another one. With
/// World::corners_through_paper, the corner camera detects it anyway.
struct HiddenTag {
  TagId tag{};
  TagId by{};
  double from_m = 0;  ///< position along the line
};

/// Results for a robot that follows the line of a world exactly.
struct WorldCheck {
  double lap_m = 0;
  double min_clearance_m = 0;          ///< from the hull to the nearest tag, in 3D; infinite without tags
  std::optional<TagId> nearest_tag{};  ///< the tag with the smallest distance
  Eigen::Vector2d nearest_place_m = Eigen::Vector2d::Zero();  ///< where on the line it is nearest
  double two_tags_fraction = 0;  ///< fraction of the line from which the camera sees at least two tags
  double one_tag_fraction = 0;   ///< fraction of the line from which it sees at least one tag
  std::size_t fewest_tags = 0;   ///< smallest number of tags in view anywhere on the line
  double sharpest_left_1_m = 0;  ///< largest curvature to the left; 0 if there is none
  double sharpest_right_1_m = 0;
  /// pairs of tags that overlap or intersect each other
  std::vector<std::pair<TagId, TagId>> overlapping{};
  std::vector<HiddenTag> hidden{};
};

/// Drives along the line in steps of 2 cm without noise. A tag is in view if visible_corners() and the range
/// of the simulated camera accept it and nothing hides it. Fails if the world has no line. O(tags² + length ·
/// (tags + tags in view · tags)).
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

/// Result of moving a camera in an orbit around the tags, which checks the frame conventions.
struct OrbitReport {
  double radius_m = 0;
  Eigen::Vector3d map_t_center = Eigen::Vector3d::Zero();
  std::vector<SE3> map_T_cam{};           ///< nominal poses
  std::vector<SE3> map_T_cam_composed{};  ///< via the anchor (equation 3.1), with noise
  TagMap tags_composed{};                 ///< via anchor and camera, with the noise of the last step

  /// Without noise: largest |log| of transforms that should be the identity. These are the camera via the
  /// anchor, every tag via the camera, the motions around the circle, and the steps from tag to tag and back.
  double closure = 0;

  /// With noise: a jump is the motion of a composed frame from one step to the next, minus the nominal
  /// motion. The limits are six standard deviations of the expected noise.
  double jump_m = 0, jump_limit_m = 0;
  double jump_deg = 0, jump_limit_deg = 0;
  double smallest_axis_cosine = 1;  ///< between an axis of a composed frame and the nominal axis

  [[nodiscard]] bool closes() const { return closure < 1e-12; }
  [[nodiscard]] bool continuous() const { return jump_m <= jump_limit_m && jump_deg <= jump_limit_deg; }
  [[nodiscard]] bool upright() const { return smallest_axis_cosine > 0; }
};

/// Numerically evaluates the validation view described by Martins and Ramos, "AprilTag-based Trajectory
/// Tracking for the LIMOS Robot", section 3.1. A nominal camera moves in a circle around the tags and faces
/// their centre. Each pose of the camera and the tags is used without noise and with noise in its own frame.
/// Fails if the world has no tags or an option is out of range. O(steps · tags).
[[nodiscard]] Result<OrbitReport> orbit(const World& world, const OrbitOptions& options = {});

}  // namespace waymark
