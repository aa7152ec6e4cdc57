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
                "Distribute the closing error of a lap over all tags instead of leaving it as one step."});
    visit(self.map_sigma_m, Field{"map_sigma_m",
                                  "Standard deviation of the position of a tag of the chain relative to its "
                                  "neighbours; limits how far tags of one frame may contradict each other.",
                                  1e-6, 10});
    visit(self.map_sigma_rad, Field{"map_sigma_rad",
                                    "Standard deviation of the orientation of a tag of the chain; tags seen "
                                    "frontally are known least.",
                                    1e-6, 3});
    FloorOptions::fields(self.floor, visit);
  }
};

struct ChainResult {
  TagMap map{};
  Trajectory trajectory{};           ///< of the base, one pose for each frame that saw a mapped tag
  std::vector<TagId> unconnected{};  ///< seen, but nothing leads from them to the anchor
  int frames_without_pose = 0;
};

/// cam_T_tag of every tag of a frame whose size is known (equation 2.13); tags that give no pose are left
/// out.
[[nodiscard]] ObservedFrame observe(const TagFrame& frame, const CameraModel& camera, const TagSizes& sizes);
/// The same by the camera of the setup that the frame names (camera_of()).
template <class Setup>
[[nodiscard]] ObservedFrame observe(const TagFrame& frame, const Setup& setup) {
  const CameraView seen_by = camera_of(setup, frame.camera);
  ObservedFrame observed = observe(frame, seen_by.camera, setup.sizes);
  if (&seen_by.base_T_cam != &setup.base_T_cam) observed.base_T_cam = seen_by.base_T_cam;
  return observed;
}

/// The map and the trajectory by composition alone (Martins and Ramos, "AprilTag-based Trajectory Tracking
/// for the LIMOS Robot", equation 3.1 and section 3.2): map_T_cam from the anchor where it is seen, and from
/// tag to tag where two are seen together; for a robot on a level floor. `base_T_cam`: of the first camera.
/// docs/concepts/teach_and_replay.md says how. Never are two ways to the same tag weighed against each other,
/// and no error is distributed: what bundle adjustment must beat. With `wheels` tags that no other tag leads
/// to are placed as well, by the way the wheels went from those that are.
///
/// Fails when the anchor is never seen. O(frames * (tags in one of them)^2).
[[nodiscard]] Result<ChainResult> map_by_chain(const std::vector<ObservedFrame>& frames, const TagId& anchor,
                                               const SE3& map_T_anchor, const TagSizes& sizes,
                                               const SE3& base_T_cam, const ChainOptions& options = {},
                                               const std::vector<Odometry>& wheels = {});

}  // namespace waymark

namespace waymark::internal {

/// from_X_to of two tags that were seen together, and how many frames agree on it.
struct Link {
  Uncertain<SE2> from_X_to{};
  int votes = 0;
};
/// From the smaller id to the larger.
using Links = std::map<std::pair<TagId, TagId>, Link>;
/// map_X_tag.
using Places = std::map<TagId, Uncertain<SE2>>;

/// Where the base was when a frame was taken, by every placed tag in it (equation 3.1, with that tag in the
/// anchor's place). `noise`: covariance of a place relative to its neighbours.
[[nodiscard]] std::vector<Vote<SE2>> votes_for_base(const FloorFrame& frame, const Places& places,
                                                    const Eigen::Matrix3d& noise);

/// For each pair of tags what all frames that saw both agree on.
[[nodiscard]] Links links_of(const std::vector<FloorFrame>& frames);

/// From the anchor outwards, by composition: the next tag is always the one that would be known best. Links
/// that few frames agree on, which one id read wrongly can make, are followed only where no better one leads
/// on. O(links * tags that wait at a time).
[[nodiscard]] Places compose_from_anchor(const Links& links, const TagId& anchor, const SE2& map_X_anchor);

/// Moves all tags but the anchor so that the links disagree least: what the two ways round a lap differ by
/// where they meet is spread over the whole chain. Links that contradict all others count little.
void spread_closing_error(const Links& links, const TagId& anchor, Places& places);

/// Places tags that no other tag leads to: those of the next aisle, or of another room. Tags that links tie
/// to each other are placed as the chain places them, and the whole of them where the wheels have it, from
/// the last frame before that saw placed tags, or else the first one after. So what wheels add up to from one
/// end of the way to the other is not in how the frames about a tag stand to each other, which is what a
/// search begins with. `noise`: as in votes_for_base(). Tags that too few frames agree on are left out.
/// O(frames + links).
void place_islands(const std::vector<FloorFrame>& frames, const Links& links, const OdometryTrack& wheels,
                   const Eigen::Matrix3d& noise, bool spread_closing_errors, Places& places);

}  // namespace waymark::internal
