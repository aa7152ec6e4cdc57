#pragma once

#include <optional>
#include <vector>

#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Odometry as a function of time.
class OdometryTrack {
 public:
  /// Samples whose stamp is not later than the previous one are skipped.
  explicit OdometryTrack(const std::vector<Odometry>& odometry);

  /// odom_T_base at a given time, interpolated along the twist between the adjacent samples. Empty outside
  /// the range of the samples or if the adjacent samples are more than `max_gap` apart. O(log n).
  [[nodiscard]] std::optional<SE2> at(SensorTime stamp,
                                      Duration max_gap = std::chrono::milliseconds(500)) const;

  /// Twist per second at a given time (m/s, m/s, rad/s), averaged over `window`; empty if at() is empty.
  [[nodiscard]] std::optional<SE2::Tangent> rate_at(SensorTime stamp,
                                                    Duration window = std::chrono::milliseconds(60)) const;

  [[nodiscard]] bool empty() const { return samples_.empty(); }
  [[nodiscard]] int left_out() const { return left_out_; }

 private:
  std::vector<Odometry> samples_;
  int left_out_ = 0;
};

}  // namespace waymark

namespace waymark::internal {

/// The integral of the rate that a gyro measured about the floor's normal, as a function of time.
class GyroTrack {
 public:
  /// Samples whose stamp is not later than the previous one, and samples with a non-finite rate, are skipped.
  explicit GyroTrack(const std::vector<ImuSample>& samples);

  /// Rotation between two times; empty if samples are missing for more than 0.2 s between these times or at
  /// either of them. O(log n).
  [[nodiscard]] std::optional<double> turn(SensorTime from, SensorTime to) const;

 private:
  struct Moment {
    SensorTime stamp{};
    double rate = 0, angle_rad = 0;
    int gaps = 0;  ///< number of gaps before this sample
  };

  [[nodiscard]] std::optional<Moment> at(SensorTime stamp) const;

  std::vector<Moment> track_;
};

}  // namespace waymark::internal
