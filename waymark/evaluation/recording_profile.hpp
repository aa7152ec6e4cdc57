#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

/// What a recording sounds like, without any truth: rates, gaps, noises, speeds; with a map and a trajectory
/// also how the robot turns and how far the camera sees. The same measure for a real recording and for a
/// simulated one.
namespace waymark {

/// A stream of samples of one kind.
struct StreamProfile {
  int samples = 0;
  double rate_hz = 0;        ///< one over the mean step, gaps left out; 0 for fewer than two samples
  double jitter_s = 0;       ///< median distance of the steps from their median
  double longest_gap_s = 0;  ///< the longest step
};

/// A hole in a stream: from the last sample before it to the first after it.
struct Gap {
  double at_s = 0;  ///< since the first sample of the recording
  double for_s = 0;
};

/// The speed at a moment.
struct SpeedPoint {
  double at_s = 0;
  double speed_m_s = 0;
};

struct RecordingProfile {
  double duration_s = 0;
  /// "camera", "odometry", "imu", "lidar", "commands"; of several cameras each again as "camera NAME".
  std::map<std::string, StreamProfile> streams{};
  std::string camera{};            ///< which of several "camera" and all about tags is of: the busiest
  std::vector<Gap> camera_gaps{};  ///< steps of more than five median ones and 0.3 s
  std::vector<Gap> odometry_gaps{};
  std::optional<double> gyro_noise_rad_s{};  ///< white part, of steps from sample to sample
  std::optional<double> gyro_bias_rad_s{};   ///< mean while the robot stands; nothing when it never does
  std::optional<double> acceleration_noise_m_s2{};
  std::optional<double> corner_sigma_px{};   ///< each coordinate, within a tag, of second differences in time
  std::optional<double> miss_probability{};  ///< of a tag that is seen in the frames before and after
  std::optional<double> tags_per_frame{};
  std::optional<double> image_arrival_delay_s{};  ///< from stamp to recording, median; not known to samples
  std::optional<double> command_delay_s{};        ///< at which speeds follow commands best
  double mean_speed_m_s = 0;                      ///< while it drives
  double p95_speed_m_s = 0;
  double p95_yaw_rate_rad_s = 0;     ///< while it drives
  double standing_share = 0;         ///< of the time: it does not drive
  double turning_share = 0;          ///< of the time: it turns on the spot
  std::vector<SpeedPoint> speeds{};  ///< by odometry, ten times a second
};

/// Measures as samples come by, in order.
class RecordingProfiler {
 public:
  void add(const Sample& sample);
  /// O(n log n) in the samples received.
  [[nodiscard]] RecordingProfile profile() const;

 private:
  struct Speed {
    double at_s = 0;
    double m_s = 0;
    double rad_s = 0;
  };
  [[nodiscard]] double seconds(SensorTime stamp);
  /// What one camera saw.
  struct Camera {
    std::vector<double> stamps{};
    std::vector<double> pictures{};  ///< stamps of pictures: count where nobody looked for tags in them
    std::vector<TagFrame> frames{};  ///< corners that are not known are not finite

    [[nodiscard]] const std::vector<double>& times() const { return stamps.empty() ? pictures : stamps; }
  };
  void add(const ImuSample& imu, double at_s);
  void add(const TagPoseFrame& frame, double at_s);
  void measure_cameras(RecordingProfile& profile) const;
  void measure_imu(RecordingProfile& profile) const;
  static void add_corner_noise(const TagDetection& first, const TagDetection& middle,
                               const TagDetection& last, std::vector<double>& noise);
  static void measure_tags(const std::vector<TagFrame>& frames, RecordingProfile& profile);
  void measure_motion(RecordingProfile& profile) const;

  std::optional<SensorTime> first_{};
  std::map<std::string, std::vector<double>> stamps_{};
  std::vector<Speed> odometry_{};
  std::vector<Speed> commands_{};
  std::vector<Speed> gyro_{};  ///< rad_s
  std::vector<double> acceleration_{};
  std::map<std::string, Camera> cameras_{};
};

/// True over commanded yaw rate: regression through the origin of the turns of the trajectory within half a
/// second on the integral of the commands, which act `delay_s` later. Nothing where fewer than 20 such
/// windows were commanded to turn by 2 degrees or more. O(commands + poses).
[[nodiscard]] std::optional<double> turn_response(const std::vector<StampedCommand>& commands,
                                                  const Trajectory& trajectory, double delay_s);

/// Distance below which `share` of the observations of mapped tags lie [m]: of the camera's centre to that of
/// the tag, by map and trajectory. Nothing with fewer than 50 observations. O(n log n).
[[nodiscard]] std::optional<double> observation_distance_m(const std::vector<TagFrame>& frames,
                                                           const TagMap& map, const SE3& base_T_cam,
                                                           const Trajectory& trajectory, double share);

}  // namespace waymark
