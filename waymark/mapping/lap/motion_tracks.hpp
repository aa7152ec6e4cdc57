#pragma once

#include <optional>
#include <vector>

#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Odometry as a function of time.
class OdometryTrack {
 public:
  /// Samples whose stamp does not grow are left out.
  explicit OdometryTrack(const std::vector<Odometry>& odometry);

  /// odom_T_base at a time, along the twist between the two samples about it; nothing outside, or where
  /// samples are more than `max_gap` apart. O(log n).
  [[nodiscard]] std::optional<SE2> at(SensorTime stamp,
                                      Duration max_gap = std::chrono::milliseconds(500)) const;

  /// Its twist per second at a time (m/s, m/s, rad/s), over `window`; nothing where at() knows nothing.
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

/// The integral of a gyro's rate about the floor's normal, as a function of time.
class GyroTrack {
 public:
  /// Samples whose stamp does not grow, or whose rate is not finite, are left out.
  explicit GyroTrack(const std::vector<ImuSample>& samples);

  /// How far it turned; nothing where samples are missing for more than 0.2 s within that time, or at one of
  /// its ends. O(log n).
  [[nodiscard]] std::optional<double> turn(SensorTime from, SensorTime to) const;

 private:
  struct Moment {
    SensorTime stamp{};
    double rate = 0, angle_rad = 0;
    int gaps = 0;  ///< before it
  };

  [[nodiscard]] std::optional<Moment> at(SensorTime stamp) const;

  std::vector<Moment> track_;
};

}  // namespace waymark::internal
