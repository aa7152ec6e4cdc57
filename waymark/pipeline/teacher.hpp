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
#include "waymark/pipeline/passed_tags.hpp"
#include "waymark/replay/route_checks.hpp"
#include "waymark/samples/clock_check.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_sizes.hpp"
#include "waymark/samples/tags_in_view.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// Two tags, and the number of frames that contain both.
struct TagLink {
  TagId first{};
  TagId second{};
  int frames = 0;
};

/// Records which tags are visible together, which is what connects the map. A tag that is connected to the
/// others by only a few frames is weakly determined, as are all tags that are connected only through it.
class TagLinks {
 public:
  /// Adds the tags in one frame, in any order, without duplicates.
  void add(std::span<const TagId> tags) { add(tags, {}); }
  /// `beside` lists tags in the simultaneous frame of another camera, which has already been added.
  void add(std::span<const TagId> tags, std::span<const TagId> beside);

  /// The weak links that hold the map together: edges of the maximum spanning forest (Kruskal, "On the
  /// shortest spanning subtree of a graph", Proc. AMS 7, 1956) with fewer than `frames` frames, in order of
  /// increasing strength. O(links log links).
  [[nodiscard]] std::vector<TagLink> weak(int frames) const;
  /// Observed tags, in order, that no chain of frames connects to `anchor`.
  [[nodiscard]] std::vector<TagId> unreachable(const TagId& anchor) const;

 private:
  [[nodiscard]] std::vector<TagLink> forest() const;

  std::map<TagId, int> seen_{};
  std::map<std::pair<TagId, TagId>, int> together_{};
};

/// Parameters that are required before a lap is taught.
struct TeachSetup {
  CameraModel camera;
  SE3 base_T_cam{};
  TagSizes sizes{};
  TagId anchor{};
  SE3 map_T_anchor{};
  bool closed_route = true;       ///< whether the lap should end where it started
  bool anchor_pose_given = true;  ///< if false, mapping places the map according to the pose of the anchor
                                  ///< relative to the floor
  std::optional<Hull> hull{};     ///< of the robot, for the distance from tags; not checked if empty
  std::vector<MountedCamera> more_cameras{};  ///< cameras other than the first; frames that carry none of
                                              ///< their names are from the first
};

/// Result for one frame in the teach phase; all of it is recorded.
struct TaughtFrame {
  ObservedFrame observed{};        ///< cam_T_tag(t) of every visible tag
  std::optional<SE3> map_T_cam{};  ///< pose of the first camera, if the anchor is visible
  bool low_observability = false;  ///< whether all cameras together see fewer than two tags; the frame is
                                   ///< marked, but this is no reason to abort
};

/// The counters of Algorithm 1, line 15, and what they show.
struct TeachSummary {
  int frames = 0;
  int detections = 0;  ///< with usable corners
  int unreliable = 0;  ///< detections with unreliable corners
  int low_observability_frames = 0;
  double duration_s = 0;
  double distance_m = 0;         ///< distance measured by odometry
  double longest_blind_s = 0;    ///< longest time without a single tag
  std::map<TagId, int> seen{};   ///< number of frames that contain each tag
  bool anchor_at_start = false;  ///< whether the anchor was observed in the first seconds
  bool anchor_at_end = false;    ///< whether the anchor was observed in the last seconds
  /// Whether the anchor was observed at both ends and, in the last seconds, at least once from nearly the
  /// position of the first observation. The lap may continue beyond that position.
  bool closed_loop = false;
  double clock_back_s = 0;       ///< largest backward jump of the sensor clock
  double longest_silence_s = 0;  ///< longest time without any sample
  int odometry_jumps = 0;        ///< number of odometry resets (odometry_jumped())
  /// Time between the beginnings of odometry and images if they do not overlap: they are stamped by two
  /// clocks. Then the values above that compare their stamps are 0.
  std::optional<double> clocks_apart_s{};
  std::optional<SidewaysMotion> sideways{};  ///< sideways motion along the lap, by odometry
  std::optional<NearestTag> nearest_tag{};   ///< tag that the hull passed most closely, by odometry
  double image_arrival_delay_s = 0;  ///< delay between tags and odometry measured at the same time, if it is
                                     ///< long
  /// Whether the lap can be mapped. This requires that the anchor and another tag were observed, that neither
  /// the clock nor the odometry jumped, and that all samples are stamped by one clock. In addition, the loop
  /// must be closed if it should be; otherwise at least half a metre must have been driven.
  bool mappable = false;
  std::vector<TagLink> weak_links{};  ///< links of few frames whose loss would split the map, weakest first
  std::vector<TagId> unreachable{};   ///< tags that no chain of frames connects to the anchor
  std::vector<std::string> warnings{};

  [[nodiscard]] double two_tags_fraction() const;
};

/// The teach phase (Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", Algorithm
/// 1). Converts samples to taught frames, without optimisation.
class Teacher {
 public:
  explicit Teacher(TeachSetup setup);

  TaughtFrame add(const TagFrame& frame);
  /// Only counts observations and computes no pose except that of the anchor. For monitoring a lap while it
  /// is recorded, to be mapped later. The summary equals that of add(), unless a detection has no pose.
  /// Several times as fast as add().
  void watch(const TagFrame& frame);
  /// The same for a robot that sends tag poses without corners.
  void watch(const TagPoseFrame& frame);
  void add(const Odometry& odometry);
  /// The counters so far, and the reasons why the lap cannot be mapped yet.
  [[nodiscard]] TeachSummary summary() const;

 private:
  /// An observation of the anchor.
  struct AnchorObservation {
    SensorTime stamp{};
    double apart_m = 0;   ///< distance from the position of its first observation
    double driven_m = 0;  ///< distance driven before this observation
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
  void compare_clocks(TeachSummary& summary) const;
  void warn_of_route(TeachSummary& summary) const;
  void pass(const ObservedFrame& observed);
  void pass(const TagPoseFrame& frame);
  void follow(const Odometry& odometry, bool jumped);
  [[nodiscard]] bool long_enough(const TeachSummary& summary) const;

  TeachSetup setup_;
  TeachSummary counters_{};
  TagLinks links_{};
  std::optional<SensorTime> first_{};
  SensorTime last_{};
  std::optional<SensorTime> received_{};  ///< timestamp of the last sample of any kind that was not late
  std::optional<SensorTime> newest_frame_{};
  TagsInView in_view_{};
  SensorTime last_tag_{};
  std::optional<StampedPose> first_anchored_cam_{};
  std::deque<AnchorObservation> last_anchor_observations_{};  ///< observations in the last seconds
  std::optional<Odometry> odometry_{};
  ClockCheck clocks_{};
  std::optional<PassedTags> passed_{};
  Trajectory driven_{};  ///< by odometry; resets of the odometry are joined
  SE2 driven_T_odom_{};
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

/// Monitors a lap while it is being taught, and warns while the driver can still correct problems.
class TeachMonitor {
 public:
  explicit TeachMonitor(const TeachMonitorOptions& options) : options_(options) {}

  /// Adds samples, which must be in order; only odometry and tag frames are used.
  void add(const Sample& sample);

  /// Motion of a distant point in the image during the exposure: yaw rate x exposure x focal length [px].
  [[nodiscard]] double motion_blur_px() const;
  /// Change in the odometry speed over the window.
  [[nodiscard]] double acceleration_m_s2() const;
  /// Current problems, in a few words each; empty if there are none.
  [[nodiscard]] std::vector<std::string> live() const;
  /// Problems that lasted long enough to degrade the lap, and how to avoid them.
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
  std::map<std::string, std::size_t> tags_{};  ///< number of tags in the last frame from each camera
  bool abrupt_ = false;
  int frames_ = 0;
  int blurred_frames_ = 0;
  int abrupt_moments_ = 0;
  double worst_blur_px_ = 0;
};

}  // namespace waymark
