#pragma once

#include <chrono>
#include <cstdint>

namespace waymark {

/// Duration on any clock: int64 nanoseconds.
using Duration = std::chrono::duration<std::int64_t, std::nano>;

/// The clock of the sensor that made the measurement. It has no now(), because the core takes time as an
/// argument.
struct SensorClock {
  using duration = Duration;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<SensorClock, Duration>;
  static constexpr bool is_steady = false;
};

/// The clock of the computer that received the measurement.
struct HostClock {
  using duration = Duration;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<HostClock, Duration>;
  static constexpr bool is_steady = false;
};

/// The time at which a measurement was made (for a camera, the middle of the exposure). Subtracting time
/// points from different clocks does not compile.
using SensorTime = SensorClock::time_point;
/// The time at which a measurement arrived at the computer.
using HostTime = HostClock::time_point;

/// Converts to seconds as a double, for use in formulas only.
[[nodiscard]] constexpr double to_seconds(Duration duration) {
  return static_cast<double>(duration.count()) * 1e-9;
}

}  // namespace waymark
