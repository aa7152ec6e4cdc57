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

/// What a camera that goes round the tags shows of the conventions.
struct OrbitReport {
  double radius_m = 0;
  Eigen::Vector3d map_t_center = Eigen::Vector3d::Zero();
  std::vector<SE3> map_T_cam{};           ///< nominal
  std::vector<SE3> map_T_cam_composed{};  ///< through the anchor (equation 3.1), with noise
  TagMap tags_composed{};                 ///< through anchor and camera, with the noise of the last step

  /// Without noise: largest |log| of what should be the identity: the camera through the anchor, every tag
  /// through the camera, the motions round the circle, the steps from tag to tag and back.
  double closure = 0;

  /// With noise. A jump is the motion of a composed frame from one step to the next, less the nominal one;
  /// the limits are six standard deviations of what the noise explains.
  double jump_m = 0, jump_limit_m = 0;
  double jump_deg = 0, jump_limit_deg = 0;
  double smallest_axis_cosine = 1;  ///< between an axis of a composed frame and the nominal one

  [[nodiscard]] bool closes() const { return closure < 1e-12; }
  [[nodiscard]] bool continuous() const { return jump_m <= jump_limit_m && jump_deg <= jump_limit_deg; }
  [[nodiscard]] bool upright() const { return smallest_axis_cosine > 0; }
};

/// The validation view of Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot",
/// section 3.1, with numbers: a nominal camera on a circle about the tags, looking at their middle; each pose
/// of camera and tags as it is and then disturbed in its own frame. Fails on a world without tags and on
/// options outside their ranges. O(steps · tags).
[[nodiscard]] Result<OrbitReport> orbit(const World& world, const OrbitOptions& options = {});

}  // namespace waymark
