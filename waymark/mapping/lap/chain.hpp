#pragma once

#include <map>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/lap/floor_observations.hpp"
#include "waymark/mapping/lap/motion_tracks.hpp"
#include "waymark/pose/floor_fit.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/tag_sizes.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

struct ChainOptions {
  double max_distance_m = 4.0;
  bool spread_closing_error = true;
  double map_sigma_m = 0.02;
  double map_sigma_rad = 0.03;
  FloorOptions floor{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.max_distance_m, Field{"max_distance_m", "Maximum distance of a tag that is used.", 0.1});
    visit(self.spread_closing_error,
          Field{"spread_closing_error",
                "Distribute the closing error of a lap over all tags instead of leaving it as one jump."});
    visit(self.map_sigma_m, Field{"map_sigma_m",
                                  "Standard deviation of the position of a tag of the chain relative to its "
                                  "neighbours; limits how far tags of one frame may disagree.",
                                  1e-6, 10});
    visit(self.map_sigma_rad, Field{"map_sigma_rad",
                                    "Standard deviation of the orientation of a tag of the chain; it is "
                                    "largest for tags viewed frontally.",
                                    1e-6, 3});
    FloorOptions::fields(self.floor, visit);
  }
};

struct ChainResult {
  TagMap map{};
  Trajectory trajectory{};           ///< poses of the base, one for each frame with a mapped tag
  std::vector<TagId> unconnected{};  ///< tags that were observed but are not connected to the anchor
  int frames_without_pose = 0;
};

/// Computes cam_T_tag for every tag of known size in a frame (equation 2.13); tags without a pose are
/// skipped.
[[nodiscard]] ObservedFrame observe(const TagFrame& frame, const CameraModel& camera, const TagSizes& sizes);
/// The same, using the setup's camera that is named in the frame (see camera_of()).
template <class Setup>
[[nodiscard]] ObservedFrame observe(const TagFrame& frame, const Setup& setup) {
  const CameraView seen_by = camera_of(setup, frame.camera);
  ObservedFrame observed = observe(frame, seen_by.camera, setup.sizes);
  if (&seen_by.base_T_cam != &setup.base_T_cam) observed.base_T_cam = seen_by.base_T_cam;
  return observed;
}

/// Computes the map and the trajectory by composing poses only, for a robot on a level floor. After Martins
/// and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", equation 3.1 and section 3.2. The
/// pose map_T_cam is computed from the anchor if it is in view, otherwise from tag to tag through frames with
/// two tags. `base_T_cam`: mounting pose of the first camera. See docs/concepts/teach_and_replay.md for
/// details. Different paths to a tag are not weighted against each other, and errors are not distributed.
/// This is the baseline with which bundle adjustment is compared. With `wheels`, tags that are not connected
/// through other tags are also placed, using odometry from placed tags.
///
/// Fails if the anchor is never observed. O(frames * (tags per frame)^2). `frames` of a long lap should be
/// moved, so that their memory is released early.
[[nodiscard]] Result<ChainResult> map_by_chain(std::vector<ObservedFrame> frames, const TagId& anchor,
                                               const SE3& map_T_anchor, const TagSizes& sizes,
                                               const SE3& base_T_cam, const ChainOptions& options = {},
                                               const std::vector<Odometry>& wheels = {});

}  // namespace waymark

namespace waymark::internal {

/// The motion from_X_to between two tags that were observed together, and the number of frames that agree on
/// it.
struct Link {
  Uncertain<SE2> from_X_to{};
  int votes = 0;
};
/// Links by (smaller id, larger id); the motion is from the first tag to the second.
using Links = std::map<std::pair<TagId, TagId>, Link>;
/// The pose map_X_tag of each placed tag.
using Places = std::map<TagId, Uncertain<SE2>>;

/// Base pose in a frame according to each placed tag in it (equation 3.1, with that tag instead of the
/// anchor). `noise`: covariance of a tag's place relative to its neighbours.
[[nodiscard]] std::vector<Vote<SE2>> votes_for_base(const FloorFrame& frame, const Places& places,
                                                    const Eigen::Matrix3d& noise);

/// For each pair of tags, the relative pose that the frames showing both tags agree on.
[[nodiscard]] Links links_of(const std::vector<FloorFrame>& frames);

/// Composes poses from the anchor outwards; the next tag to be placed is always the one with the smallest
/// uncertainty. Links supported by only a few frames can result from a single misread id, so they are used
/// only if no better link is available. O(links * waiting tags).
[[nodiscard]] Places compose_from_anchor(const Links& links, const TagId& anchor, const SE2& map_X_anchor);

/// Moves all tags except the anchor so that the disagreement of the links is minimal. This distributes the
/// closing error of a lap over the whole chain. Links inconsistent with all others get a low weight.
void spread_closing_error(const Links& links, const TagId& anchor, Places& places);

/// Places tags that are not connected to the anchor through other tags, such as those in the next aisle or in
/// another room. Tags connected by links are placed relative to each other as the chain places them. Their
/// common pose comes from odometry, from the last frame with placed tags before them, or else from the first
/// such frame after them. The search therefore starts from relative poses of nearby tags that are not
/// affected by odometry drift over the whole trajectory. `noise`: as in votes_for_base(). Tags with too few
/// agreeing frames are skipped. O(frames + links).
void place_islands(const std::vector<FloorFrame>& frames, const Links& links, const OdometryTrack& wheels,
                   const Eigen::Matrix3d& noise, bool spread_closing_errors, Places& places);

}  // namespace waymark::internal
