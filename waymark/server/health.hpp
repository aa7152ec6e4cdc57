#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/server/live_feed.hpp"

namespace waymark {

/// An indicator on the page, with a level that is shown as a colour, and a text.
struct HealthLight {
  enum class Level : std::uint8_t { Unknown, Good, Uncertain, Bad };
  std::string name;  ///< such as "camera"
  Level level = Level::Unknown;
  std::string message;  ///< such as "29.8 per second"
};
[[nodiscard]] std::string_view to_string(HealthLight::Level level);

/// The state of the robot's sensors and its drive, derived from received samples.
class RobotHealth {
 public:
  /// `now` is the time on the host clock when the sample was received.
  void receive(const Sample& sample, Duration now);
  [[nodiscard]] std::vector<HealthLight> lights(const LiveStatus& status, Duration now) const;

 private:
  struct Stream {
    std::optional<Duration> first{};
    Duration last{};
    double rate_hz = 0;  ///< smoothed rate
  };
  enum : std::size_t { kCamera, kOdometry, kImu, kLidar, kStreams };
  [[nodiscard]] HealthLight light_of(std::size_t stream, Duration now) const;
  std::array<Stream, kStreams> streams_{};
};

}  // namespace waymark
