#pragma once

#include <optional>
#include <span>
#include <vector>

#include "waymark/simulation/world.hpp"

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

}  // namespace waymark
