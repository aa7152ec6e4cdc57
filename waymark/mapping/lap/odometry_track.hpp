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
