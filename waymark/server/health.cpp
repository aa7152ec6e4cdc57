#include "waymark/server/health.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace waymark {
namespace {

using Level = HealthLight::Level;

constexpr double kLate_s = 0.5;
constexpr double kGone_s = 2;
constexpr std::array<const char*, 4> kNames{"camera", "odometry", "IMU", "lidar"};

HealthLight estimate_light(const LiveStatus& status) {
  HealthLight light{.name = "localisation", .level = Level::Unknown, .message = "not running"};
  if (!status.certain) return light;
  light.level = *status.certain ? Level::Good : Level::Uncertain;
  light.message = *status.certain ? "pose is certain" : "pose is uncertain";
  return light;
}

HealthLight drive_light(const LiveStatus& status) {
  HealthLight light{.name = "drive", .level = Level::Good, .message = "free"};
  if (!status.halted.empty()) {
    light.level = Level::Bad;
    light.message = status.halted;
  } else if (status.phase == "stopped" && !status.reason.empty()) {
    light.level = Level::Uncertain;
    light.message = status.reason;
  } else if (status.phase != "teaching" && status.phase != "replaying") {
    light.message = "stationary";
  }
  return light;
}

}  // namespace

std::string_view to_string(Level level) {
  constexpr std::array<std::string_view, 4> kLevels{"unknown", "good", "uncertain", "bad"};
  return kLevels[static_cast<std::size_t>(level)];
}

void RobotHealth::receive(const Sample& sample, Duration now) {
  std::size_t which = kStreams;
  if (std::holds_alternative<TagFrame>(sample) || std::holds_alternative<TagPoseFrame>(sample))
    which = kCamera;
  if (std::holds_alternative<Odometry>(sample)) which = kOdometry;
  if (std::holds_alternative<ImuSample>(sample)) which = kImu;
  if (std::holds_alternative<LaserScan>(sample)) which = kLidar;
  if (which == kStreams) return;
  Stream& stream = streams_[which];
  constexpr double kSmoothing = 0.1;
  const double gap_s = to_seconds(now - stream.last);
  if (stream.first && gap_s > 0) {
    const double mean_s = stream.rate_hz > 0 ? 1 / stream.rate_hz : gap_s;
    stream.rate_hz = 1 / (mean_s + kSmoothing * (gap_s - mean_s));
  }
  if (!stream.first) stream.first = now;
  if (gap_s > 0) stream.last = now;
}

HealthLight RobotHealth::light_of(std::size_t which, Duration now) const {
  const Stream& stream = streams_[which];
  HealthLight light{.name = kNames[which], .level = Level::Unknown, .message = "no data yet"};
  if (!stream.first) return light;
  const double age_s = to_seconds(now - stream.last);
  light.level = age_s < kLate_s ? Level::Good : age_s < kGone_s ? Level::Uncertain : Level::Bad;
  light.message = light.level == Level::Good ? fmt::format("{:.0f} per second", stream.rate_hz)
                                             : fmt::format("silent for {:.1f} s", age_s);
  return light;
}

std::vector<HealthLight> RobotHealth::lights(const LiveStatus& status, Duration now) const {
  std::vector<HealthLight> lights{light_of(kCamera, now), light_of(kOdometry, now)};
  for (const std::size_t extra : {std::size_t{kImu}, std::size_t{kLidar}}) {  // only for optional sensors
    if (streams_[extra].first) lights.push_back(light_of(extra, now));
  }
  lights.push_back(estimate_light(status));
  lights.push_back(drive_light(status));
  return lights;
}

}  // namespace waymark
