#pragma once

#include <map>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/tag_sizes.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// A tag as one frame saw it: the better of its two poses.
struct TagPoseObservation {
  TagId tag{};
  SE3 cam_T_tag{};
  double ambiguity_ratio = 0;  ///< of TagPose: near 1 the other pose fits as well
};

/// What one frame saw.
struct ObservedFrame {
  SensorTime stamp{};
  std::vector<TagPoseObservation> tags{};
};

struct ChainOptions {
  double max_ambiguity = 0.6;
  double max_distance_m = 4.0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.max_ambiguity,
          Field{"max_ambiguity",
                "A tag whose two poses fit almost equally (ratio of their errors) is left out.", 0, 1});
    visit(self.max_distance_m, Field{"max_distance_m", "Farther tags are left out.", 0.1});
  }
};

struct ChainResult {
  TagMap map{};
  Trajectory trajectory{};           ///< of the base, one pose for each frame that saw a mapped tag
  std::vector<TagId> unconnected{};  ///< seen, but never together with a tag that leads to the anchor
  int frames_without_pose = 0;
};

/// cam_T_tag of every tag of a frame whose size is known (equation 2.13); tags that give no pose are left
/// out.
[[nodiscard]] ObservedFrame observe(const TagFrame& frame, const CameraModel& camera, const TagSizes& sizes);

/// The map and the trajectory by composition alone (Martins and Ramos, "AprilTag-based Trajectory Tracking
/// for the LIMOS Robot", equation 3.1 and section 3.2): map_T_cam from the anchor where it is seen, and from
/// tag to tag where two are seen together. For each pair of tags the one frame that saw both nearest counts;
/// each tag is reached from the anchor by the way with the smallest sum of squared distances (Dijkstra).
/// Nothing is averaged: what bundle adjustment must beat.
///
/// Fails when the anchor is never seen. O(frames * tags^2).
[[nodiscard]] Result<ChainResult> map_by_chain(const std::vector<ObservedFrame>& frames, const TagId& anchor,
                                               const SE3& map_T_anchor, const TagSizes& sizes,
                                               const SE3& base_T_cam, const ChainOptions& options = {});

}  // namespace waymark
