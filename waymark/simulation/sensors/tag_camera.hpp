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

/// A flat rectangle that hides what is behind it, from either side: the paper of a tag, or a panel.
struct Screen {
  SE3 screen_T_map{};  ///< to its own frame: origin in the middle, z along its normal
  double half_width_m = 0, half_height_m = 0;
  std::optional<TagId> tag{};  ///< whose paper it is
};

/// The paper of a tag with so much white around it, as the renderer draws it.
[[nodiscard]] Screen paper_of(const TagId& tag, const MappedTag& placed, double margin_cells);

/// The papers of every readable tag, and the panels. O(tags + panels).
[[nodiscard]] std::vector<Screen> screens_of(const World& world);

/// Whether the screen covers a part of the tag's black square, seen from there. What is less than 5 mm behind
/// the screen is on it, and not covered. The part of the square behind the screen, projected to its plane, is
/// clipped to the rectangle (Sutherland and Hodgman, "Reentrant polygon clipping", CACM 17(1), 1974). O(1).
[[nodiscard]] bool hides(const Screen& screen, const Eigen::Vector3d& map_p_eye, const MappedTag& tag);

/// The first of the screens that hides the tag. O(screens).
[[nodiscard]] const Screen* hiding_screen(std::span<const Screen> screens, const Eigen::Vector3d& map_p_eye,
                                          const MappedTag& tag);

/// Whether no wall and no occluder stands before the middle or a corner of the tag. O(walls + occluders).
[[nodiscard]] bool walls_leave_open(const World& world, const Eigen::Vector3d& map_p_eye,
                                    const MappedTag& tag);

/// Whether the paper (without a further margin) of one of two tags lies on, or cuts, the black square of the
/// other. Tags back to back do not overlap. O(1).
[[nodiscard]] bool overlap(const TagCopy& a, const TagCopy& b);

/// A camera and detector in one: corners with noise instead of pictures.
struct TagCameraOptions {
  double corner_sigma_px = 0.1;  ///< no weight: the noise that is drawn and added to true corners
  double small_tag_sigma_px = 2.0;
  double miss_probability = 0.02;
  double max_range_m = 4.0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.corner_sigma_px,
          Field{"corner_sigma_px", "Standard deviation of each corner coordinate of a large tag.", 0, 10});
    visit(self.small_tag_sigma_px,
          Field{"small_tag_sigma_px",
                "Further standard deviation of small tags: this number divided by the side in pixels.", 0,
                100});
    visit(self.miss_probability,
          Field{"miss_probability", "Probability that a visible tag is not detected in a frame.", 0, 1});
    visit(self.max_range_m, Field{"max_range_m", "Maximum distance of a detected tag.", 0});
  }
};

/// What the detector would say of a frame taken from map_T_cam: corners with white noise and the covariance
/// of that noise. A tag of which a part is hidden behind another tag's paper or a panel, or whose middle or a
/// corner is hidden behind a wall or furniture, is not seen; papers and panels hide nothing where
/// World::corners_through_paper says so. O(tags + tags in view * tags).
[[nodiscard]] TagFrame see_tags(const World& world, const CameraModel& camera, const SE3& map_T_cam,
                                SensorTime stamp, const TagCameraOptions& options, Random& random);

}  // namespace waymark
