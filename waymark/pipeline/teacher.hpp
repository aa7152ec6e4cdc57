#pragma once

#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/families/family.hpp"
#include "waymark/mapping/lap/chain.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_sizes.hpp"
#include "waymark/samples/tags_in_view.hpp"

namespace waymark {

/// Two tags, and how many frames show both.
struct TagLink {
  TagId first{};
  TagId second{};
  int frames = 0;
};

/// Which tags were seen together: what holds a map together. A tag that is joined to the others by few frames
/// hangs loosely, and everything behind it with it.
class TagLinks {
 public:
  /// The tags of one frame, in any order, each once.
  void add(std::span<const TagId> tags) { add(tags, {}); }
  /// `beside`: what another camera showed at the same moment, and was added already.
  void add(std::span<const TagId> tags, std::span<const TagId> beside);

  /// The weakest links that the map cannot do without: those of the maximum spanning forest (Kruskal, "On the
  /// shortest spanning subtree of a graph", Proc. AMS 7, 1956) with fewer than `frames` frames, the weakest
  /// first. O(links log links).
  [[nodiscard]] std::vector<TagLink> weak(int frames) const;
  /// Tags that were seen but are joined to `anchor` through no chain of frames, in order.
  [[nodiscard]] std::vector<TagId> unreachable(const TagId& anchor) const;

 private:
  [[nodiscard]] std::vector<TagLink> forest() const;

  std::map<TagId, int> seen_{};
  std::map<std::pair<TagId, TagId>, int> together_{};
};

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
  double image_arrival_delay_s =
      0;  ///< how far tags came behind the odometry of their time, where that is long
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
  struct AnchorObservation {
    SensorTime stamp{};
    double apart_m = 0;   ///< from where it was seen first
    double driven_m = 0;  ///< until then
  };

  void count(SensorTime stamp, const std::string& camera, const std::vector<TagId>& tags,
             const std::optional<SE3>& map_T_cam);
  [[nodiscard]] std::optional<SE3> anchored(const ObservedFrame& observed) const;
  void keep_anchor_observation(SensorTime stamp, const SE3& map_T_cam);
  [[nodiscard]] bool came_back(SensorTime since) const;
  void receive(SensorTime stamp, bool is_frame);
  void warn_of_views(TeachSummary& summary) const;
  void warn_of_links(TeachSummary& summary) const;
  void warn_of_stamps(TeachSummary& summary) const;
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
  std::deque<AnchorObservation> last_anchor_observations_{};  ///< of the seconds before the last one
  std::optional<Odometry> odometry_{};
};

struct TeachMonitorOptions {
  double exposure_ms = 10;
  double focal_length_px = 440;
  double blur_px = 2;
  double acceleration_m_s2 = 2.5;
  double window_s = 0.1;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.exposure_ms, Field{"exposure_ms", "Exposure time of the camera.", 0, 1000});
    visit(self.focal_length_px, Field{"focal_length_px", "Focal length of the camera, px.", 1, 1e6});
    visit(self.blur_px, Field{"blur_px", "Motion blur above which a warning is given, px.", 0, 1000});
    visit(self.acceleration_m_s2,
          Field{"acceleration_m_s2", "Acceleration above which a warning is given.", 0, 100});
    visit(self.window_s, Field{"window_s", "Time over which an acceleration is measured.", 0.01, 10});
  }
};

/// Looks over the shoulder of somebody who drives a teach lap: what is said while it can still be mended.
class TeachMonitor {
 public:
  explicit TeachMonitor(const TeachMonitorOptions& options) : options_(options) {}

  /// Samples in order; only odometry and frames of tags matter.
  void add(const Sample& sample);

  /// How far the picture of something far away goes while the shutter is open: yaw rate x exposure x focal
  /// length [px].
  [[nodiscard]] double motion_blur_px() const;
  /// Change of speed by odometry over the window.
  [[nodiscard]] double acceleration_m_s2() const;
  /// What is wrong at this moment, in a few words each; empty when all is well.
  [[nodiscard]] std::vector<std::string> live() const;
  /// What was wrong for so long that the lap suffers, in sentences that say what to do.
  [[nodiscard]] std::vector<std::string> summary() const;
  [[nodiscard]] double worst_blur_px() const { return worst_blur_px_; }
  [[nodiscard]] int blurred_frames() const { return blurred_frames_; }
  [[nodiscard]] int abrupt_moments() const { return abrupt_moments_; }

 private:
  struct Speed {
    SensorTime stamp{};
    double m_s = 0;
  };
  void follow(const Odometry& odometry);
  void count(const std::string& camera, std::size_t tags);

  TeachMonitorOptions options_;
  std::deque<Speed> speeds_{};
  double yaw_rate_rad_s_ = 0;
  std::map<std::string, std::size_t> tags_{};  ///< of the last frame of each camera
  bool abrupt_ = false;
  int frames_ = 0;
  int blurred_frames_ = 0;
  int abrupt_moments_ = 0;
  double worst_blur_px_ = 0;
};

}  // namespace waymark
