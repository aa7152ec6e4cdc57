#pragma once

#include <optional>
#include <vector>

#include "waymark/mapping/lap/floor_observations.hpp"
#include "waymark/samples/observed_motion.hpp"

namespace waymark::internal {

/// Motion of the base between two frames of one camera according to their common tags: the medians over the
/// tags, with the standard deviations of the most accurate of them. Empty if there are no common tags.
[[nodiscard]] std::optional<ObservedMotion> motion_by_tags(const FloorFrame& from, const FloorFrame& to);

}  // namespace waymark::internal

namespace waymark {

/// Motions of the base over about one second according to the first camera. They require neither a map nor
/// correct tag ids; the turns do not depend on tag sizes either. `observed`: frames in stamp order.
/// `base_T_cam`: mounting of the first camera. O(frames * tags per frame).
[[nodiscard]] std::vector<ObservedMotion> motions_by_tags(const std::vector<ObservedFrame>& observed,
                                                          const SE3& base_T_cam);

}  // namespace waymark
