#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/samples/robot_samples.hpp"

/// What a recording sounds like, without any truth: rates, gaps, noises, speeds. The same measure for a real
/// recording and for a simulated one.
namespace waymark {

/// A stream of samples of one kind.
struct StreamProfile {
  int samples = 0;
  double rate_hz = 0;        ///< one over the median step; 0 for fewer than two samples
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
  std::map<std::string, StreamProfile> streams{};  ///< "camera", "odometry", "imu", "lidar", "commands"
  std::vector<Gap> camera_gaps{};                  ///< steps of more than five median ones and 0.3 s
  std::vector<Gap> odometry_gaps{};
  std::optional<double> gyro_noise_rad_s{};  ///< white part, of steps from sample to sample
  std::optional<double> gyro_bias_rad_s{};   ///< mean while the robot stands; nothing when it never does
  std::optional<double> acceleration_noise_m_s2{};
  std::optional<double> corner_sigma_px{};   ///< each coordinate, of second differences in time
  std::optional<double> miss_probability{};  ///< of a tag that is seen in the frames before and after
  std::optional<double> tags_per_frame{};
  std::optional<double> command_delay_s{};  ///< at which speeds follow commands best
  double mean_speed_m_s = 0;                ///< while it drives
  double p95_speed_m_s = 0;
  double p95_yaw_rate_rad_s = 0;
  double standing_share = 0;         ///< of the time
  std::vector<SpeedPoint> speeds{};  ///< by odometry, ten times a second
};

/// Measures as samples come by, in order.
class RecordingProfiler {
 public:
  void add(const Sample& sample);
  /// O(n log n) in the samples heard.
  [[nodiscard]] RecordingProfile profile() const;

 private:
  struct Speed {
    double at_s = 0;
    double m_s = 0;
    double rad_s = 0;
  };
  [[nodiscard]] double seconds(SensorTime stamp);
  void add(const ImuSample& imu, double at_s);
  void measure_imu(RecordingProfile& profile) const;
  void measure_tags(RecordingProfile& profile) const;
  void measure_motion(RecordingProfile& profile) const;

  std::optional<SensorTime> first_{};
  std::map<std::string, std::vector<double>> stamps_{};
  std::vector<Speed> odometry_{};
  std::vector<Speed> commands_{};
  std::vector<Speed> gyro_{};  ///< rad_s
  std::vector<double> acceleration_{};
  std::vector<TagFrame> frames_{};
};

}  // namespace waymark
