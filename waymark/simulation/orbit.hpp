#pragma once

#include <cstdint>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/simulation/world.hpp"

namespace waymark {

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
