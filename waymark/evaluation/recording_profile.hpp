#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

/// Properties of a recording that can be computed without ground truth: rates, gaps, noise, speeds. Given a
/// map and a trajectory, also the turn response and the observation distance. They are computed identically
/// for real and simulated recordings.
namespace waymark {

/// Timing of one kind of sample.
struct StreamProfile {
  int samples = 0;
  double rate_hz = 0;   ///< inverse of the mean step, excluding gaps; 0 if there are fewer than two samples
  double jitter_s = 0;  ///< median absolute deviation of the steps
  double longest_gap_s = 0;  ///< the longest step
};

/// A gap in a stream, from the last sample before it to the first one after it.
struct Gap {
  double at_s = 0;  ///< time since the first sample of the recording
  double for_s = 0;
};

/// The speed at one point in time.
struct SpeedPoint {
  double at_s = 0;
  double speed_m_s = 0;
};

struct RecordingProfile {
  double duration_s = 0;
  /// "camera", "odometry", "imu", "lidar", "commands"; with several cameras also "camera NAME" for each of
  /// them.
  std::map<std::string, StreamProfile> streams{};
  std::string camera{};  ///< the camera with the most samples, to which "camera" and all tag values refer
  std::vector<Gap> camera_gaps{};  ///< steps longer than five times the median and 0.3 s
  std::vector<Gap> odometry_gaps{};
  std::optional<double> gyro_noise_rad_s{};  ///< white noise, from differences between consecutive samples
  std::optional<double> gyro_bias_rad_s{};   ///< mean at standstill; `nullopt` if the robot never stops
  std::optional<double> acceleration_noise_m_s2{};
  std::optional<double>
      corner_sigma_px{};  ///< for each coordinate relative to its tag, from second differences over time
  std::optional<double> miss_probability{};  ///< for a tag that is in the frames before and after
  std::optional<double> tags_per_frame{};
  std::optional<double> image_arrival_delay_s{};  ///< median time from timestamp to recording; cannot be
                                                  ///< computed from samples alone
  std::optional<double> command_delay_s{};        ///< the delay for which speeds best match commands
  double mean_speed_m_s = 0;                      ///< while the robot is driving
  double p95_speed_m_s = 0;
  double p95_yaw_rate_rad_s = 0;     ///< while the robot is driving
  double standing_share = 0;         ///< fraction of the time spent stationary
  double turning_share = 0;          ///< fraction of the time spent turning on the spot
  std::vector<SpeedPoint> speeds{};  ///< from odometry, ten values per second
};

/// Computes a RecordingProfile from samples in time order.
class RecordingProfiler {
 public:
  void add(const Sample& sample);
  /// O(n log n) in the number of samples.
  [[nodiscard]] RecordingProfile profile() const;

 private:
  struct Speed {
    double at_s = 0;
    double m_s = 0;
    double rad_s = 0;
  };
  [[nodiscard]] double seconds(SensorTime stamp);
  /// Samples from one camera.
  struct Camera {
    std::vector<double> stamps{};
    std::vector<double> images{};    ///< timestamps of images, used if the images were not searched for tags
    std::vector<TagFrame> frames{};  ///< unknown corners are non-finite

    [[nodiscard]] const std::vector<double>& times() const { return stamps.empty() ? images : stamps; }
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
  std::vector<Speed> gyro_{};  ///< [rad/s]
  std::vector<double> acceleration_{};
  std::map<std::string, Camera> cameras_{};
};

/// Ratio of actual to commanded yaw rate. Computed by regression through the origin of the turns in the
/// trajectory over 0.5 s against the integral of the commands, delayed by `delay_s`. `nullopt` if fewer than
/// 20 such windows contain a commanded turn of at least 2 degrees. O(commands + poses).
[[nodiscard]] std::optional<double> turn_response(const std::vector<StampedCommand>& commands,
                                                  const Trajectory& trajectory, double delay_s);

/// Distance within which the fraction `share` of the observations of map tags lies [m], measured from camera
/// centre to tag centre using the map and the trajectory. `nullopt` if there are fewer than 50 observations.
/// O(n log n).
[[nodiscard]] std::optional<double> observation_distance_m(const std::vector<TagFrame>& frames,
                                                           const TagMap& map, const SE3& base_T_cam,
                                                           const Trajectory& trajectory, double share);

}  // namespace waymark
