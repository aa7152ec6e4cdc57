#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/mapping/lap/chain.hpp"
#include "waymark/pipeline/tag_links.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_sizes.hpp"
#include "waymark/samples/tags_in_view.hpp"

namespace waymark {

/// What must be known before a lap is taught.
struct TeachSetup {
  CameraModel camera;
  SE3 base_T_cam{};
  TagSizes sizes{};
  TagId anchor{};
  SE3 map_T_anchor{};
  bool closed_route = true;       ///< the lap is meant to end where it began
  bool anchor_pose_given = true;  ///< false: mapping places the map by how the anchor stands on the floor
  std::vector<MountedCamera> more_cameras{};  ///< beside the first, whose frames name none of them
};

/// What one frame of the teach phase gives: all of it goes into the recording.
struct TaughtFrame {
  ObservedFrame observed{};        ///< cam_T_tag(t) of every visible tag
  std::optional<SE3> map_T_cam{};  ///< of the first camera, when the anchor is seen
  bool low_observability = false;  ///< fewer than two tags in all cameras; marked, not a reason to abort
};

/// The counters of Algorithm 1, line 15, and what they mean.
struct TeachSummary {
  int frames = 0;
  int detections = 0;
  int low_observability_frames = 0;
  double duration_s = 0;
  double distance_m = 0;         ///< by odometry
  double longest_blind_s = 0;    ///< without a single tag
  std::map<TagId, int> seen{};   ///< frames that saw each tag
  bool anchor_at_start = false;  ///< in the first seconds
  bool anchor_at_end = false;    ///< in the last seconds
  /// Seen at both ends, and in the last seconds once from nearly the place of the first time: a lap may go on
  /// beyond it.
  bool closed_loop = false;
  double clock_back_s = 0;       ///< how far the sensors' clock went back, at most
  double longest_silence_s = 0;  ///< without any sample at all
  int odometry_jumps = 0;        ///< where odometry was set back (odometry_jumped())
  double late_pictures_s = 0;    ///< how far tags came behind the odometry of their time, where that is long
  /// A map can be made: the anchor and another tag were seen, clock and odometry held, and the loop is closed
  /// where it was meant to be, or half a metre was driven where it was not.
  bool mappable = false;
  std::vector<TagLink> weak_links{};  ///< without which the map falls apart, of few frames; weakest first
  std::vector<TagId> unreachable{};   ///< joined to the anchor by no chain of frames
  std::vector<std::string> warnings{};

  [[nodiscard]] double two_tags_fraction() const;
};

/// The teach phase (Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", Algorithm
/// 1): samples in, taught frames out, nothing optimised.
class Teacher {
 public:
  explicit Teacher(TeachSetup setup) : setup_(std::move(setup)) {}

  TaughtFrame add(const TagFrame& frame);
  /// Only counts, and solves for no other pose than that of the anchor: for one who watches a lap that is
  /// recorded and mapped later. The summary is that of add(), unless a detection has no pose. Several times
  /// as fast.
  void watch(const TagFrame& frame);
  /// The same of a robot that gives poses of tags without corners.
  void watch(const TagPoseFrame& frame);
  void add(const Odometry& odometry);
  /// The counters so far, and in words what is missing to make a map of the lap.
  [[nodiscard]] TeachSummary summary() const;

 private:
  /// The anchor was seen.
  struct AnchorSight {
    SensorTime stamp{};
    double apart_m = 0;   ///< from where it was seen first
    double driven_m = 0;  ///< until then
  };

  void count(SensorTime stamp, const std::string& camera, const std::vector<TagId>& tags,
             const std::optional<SE3>& map_T_cam);
  [[nodiscard]] std::optional<SE3> anchored(const ObservedFrame& observed) const;
  void keep_sight(SensorTime stamp, const SE3& map_T_cam);
  [[nodiscard]] bool came_back(SensorTime since) const;
  void receive(SensorTime stamp, bool is_frame);
  void judge_views(TeachSummary& summary) const;
  void judge_links(TeachSummary& summary) const;
  void judge_stamps(TeachSummary& summary) const;
  [[nodiscard]] bool long_enough(const TeachSummary& summary) const;

  TeachSetup setup_;
  TeachSummary counters_{};
  TagLinks links_{};
  std::optional<SensorTime> first_{};
  SensorTime last_{};
  std::optional<SensorTime> received_{};  ///< the last sample of any kind that was not late
  std::optional<SensorTime> newest_frame_{};
  TagsInView in_view_{};
  SensorTime last_tag_{};
  std::optional<StampedPose> first_anchored_cam_{};
  std::deque<AnchorSight> last_sights_{};  ///< of the seconds before the last one
  std::optional<Odometry> odometry_{};
};

}  // namespace waymark
