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

/// One indicator on the page: a level shown as a colour, and a text.
struct HealthLight {
  enum class Level : std::uint8_t { Unknown, Good, Uncertain, Bad };
  std::string name;  ///< "camera"
  Level level = Level::Unknown;
  std::string message;  ///< "29.8 per second"
};
[[nodiscard]] std::string_view to_string(HealthLight::Level level);

/// State of the robot's sensors and drive, from the samples received.
class RobotHealth {
 public:
  /// `now`: host clock at reception.
  void receive(const Sample& sample, Duration now);
  [[nodiscard]] std::vector<HealthLight> lights(const LiveStatus& status, Duration now) const;

 private:
  struct Stream {
    std::optional<Duration> first{};
    Duration last{};
    double rate_hz = 0;  ///< smoothed
  };
  enum : std::size_t { kCamera, kOdometry, kImu, kLidar, kStreams };
  [[nodiscard]] HealthLight light_of(std::size_t stream, Duration now) const;
  std::array<Stream, kStreams> streams_{};
};

}  // namespace waymark
