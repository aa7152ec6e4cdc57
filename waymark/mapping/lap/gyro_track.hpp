#pragma once

#include <optional>
#include <vector>

#include "waymark/samples/robot_samples.hpp"

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
