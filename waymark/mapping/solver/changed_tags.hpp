#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/families/family.hpp"
#include "waymark/mapping/solver/bundle.hpp"

/// Tags that changed during a recording, or since the map that the recording extends was made.
namespace waymark {

/// Observations of one id that follow each other in time show a tag that was moved, if their places are less
/// than this far apart. Otherwise, they show two tags.
inline constexpr double kMaxMoved_m = 1.0;

/// A pose of an id on a body, and its number of observations.
struct ObservedPose {
  SE3 body_T_tag{};
  double observations = 0;
};

/// Whether tags at these poses would overlap: they are less than half a side apart and face the same way. No
/// two prints do.
[[nodiscard]] bool would_overlap(const SE3& body_T_tag, const SE3& body_T_other, double side_m);

/// Whether the observations of an id at a place belong to another tag on the same body, whose id was misread.
/// The two would then overlap, and the other has far more observations. If it does not, one tag may have
/// replaced the other.
[[nodiscard]] bool is_misread(const ObservedPose& place, const ObservedPose& other, double side_m);

/// A tag that was moved during the recording.
struct MovedTag {
  TagId tag{};
  /// Its pose in the bundle before the move, if the bundle has one. The map has the one after it.
  std::optional<PoseIndex> earlier{};
  double last_before_s = 0, first_after_s = 0;  ///< its observations before and after, since the first frame
  double distance_m = 0, angle_rad = 0;         ///< between the two poses
};

/// A tag that should have been observed after its last observation, or at all, but was not. The map still
/// contains it.
struct MissingTag {
  TagId tag{};
  int expected_images = 0;  ///< after its last observation, if the recording has one
  int passes = 0;           ///< periods of time with these images
  /// Time of its last observation since the first frame; empty if the recording has none.
  std::optional<double> last_seen_s{};
};

/// What is reported about a tag, after its name.
[[nodiscard]] std::string describe(const MovedTag& moved);

/// One warning per tag, or one for all if there are more than five. `name`: of a tag in these warnings.
[[nodiscard]] std::vector<std::string> describe(const std::vector<MissingTag>& missing,
                                                const std::function<std::string(const TagId&)>& name);

}  // namespace waymark
