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

/// One light of the page: a colour for the eye, and words for everybody.
struct HealthLight {
  enum class Level : std::uint8_t { Unknown, Good, Doubtful, Bad };
  std::string name;  ///< "camera"
  Level level = Level::Unknown;
  std::string words;  ///< "29.8 a second"
};
[[nodiscard]] std::string_view to_string(HealthLight::Level level);

/// How the robot fares, told by what is heard of it.
class RobotHealth {
 public:
  /// `now`: of the host's clock, when it was received.
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
