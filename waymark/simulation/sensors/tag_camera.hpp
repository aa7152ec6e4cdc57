#pragma once

#include <optional>
#include <span>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {

/// A flat rectangle that hides objects behind it, from either side: the paper of a tag, or a panel.
struct Screen {
  SE3 screen_T_map{};  ///< frame of the screen: origin in the middle, z along its normal
  double half_width_m = 0, half_height_m = 0;
  std::optional<TagId> tag{};  ///< the tag on this paper
};

/// The paper of a tag with this white margin, as drawn by the renderer.
[[nodiscard]] Screen paper_of(const TagId& tag, const MappedTag& placed, double margin_cells);

/// The papers of all readable tags, and the panels. O(tags + panels).
[[nodiscard]] std::vector<Screen> screens_of(const World& world);

/// Whether the screen covers part of the tag's black square as seen from the eye. A tag less than 5 mm behind
/// the screen counts as lying on it and is not covered. The part of the square behind the screen, projected
/// onto its plane, is clipped to the rectangle (Sutherland and Hodgman, "Reentrant polygon clipping", CACM
/// 17(1), 1974). O(1).
[[nodiscard]] bool hides(const Screen& screen, const Eigen::Vector3d& map_p_eye, const MappedTag& tag);

/// The first screen that hides the tag, or nullptr. O(screens).
[[nodiscard]] const Screen* hiding_screen(std::span<const Screen> screens, const Eigen::Vector3d& map_p_eye,
                                          const MappedTag& tag);

/// Whether neither a wall nor an occluder is in front of the centre or a corner of the tag. O(walls +
/// occluders).
[[nodiscard]] bool walls_leave_open(const World& world, const Eigen::Vector3d& map_p_eye,
                                    const MappedTag& tag);

/// Whether the paper of either tag (without an additional margin) covers or intersects the black square of
/// the other. Tags that are back to back do not overlap. O(1).
[[nodiscard]] bool overlap(const TagCopy& a, const TagCopy& b);

/// A camera and detector in one: it returns noisy corners instead of images.
struct TagCameraOptions {
  double corner_sigma_px = 0.1;  ///< standard deviation of the noise added to the true corners; not a weight
  double small_tag_sigma_px = 2.0;
  double miss_probability = 0.02;
  double max_range_m = 4.0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.corner_sigma_px,
          Field{"corner_sigma_px", "Standard deviation of each corner coordinate of a large tag.", 0, 10});
    visit(self.small_tag_sigma_px,
          Field{"small_tag_sigma_px",
                "Additional standard deviation of small tags: this value divided by the side in pixels.", 0,
                100});
    visit(self.miss_probability,
          Field{"miss_probability", "Probability that a visible tag is not detected in a frame.", 0, 1});
    visit(self.max_range_m, Field{"max_range_m", "Maximum distance of a detected tag.", 0});
  }
};

/// The detections in a frame taken from map_T_cam: corners with white noise and the covariance of that noise.
/// Tags that are partly hidden by another tag's paper or a panel are not detected, nor are tags whose centre
/// or corner is hidden by a wall or furniture. With World::corners_through_paper, papers and panels hide
/// nothing. O(tags + tags in view * tags).
[[nodiscard]] TagFrame see_tags(const World& world, const CameraModel& camera, const SE3& map_T_cam,
                                SensorTime stamp, const TagCameraOptions& options, Random& random);

}  // namespace waymark
