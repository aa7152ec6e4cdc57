#include "waymark/app/world/simulate_like.hpp"

#include <cmath>

#include <fmt/format.h>

#include "waymark/app/common/profile_table.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

/// Follows the line in the world at the speeds from the recording.
Result<LapEnd> drive_like(const SimulatedSetup& setup, const RecordingProfile& profile,
                          const LapListener& listener) {
  const auto path = sample_path(setup.world.path_m, setup.world.path_closed, 0.02);
  // Large, because the driver must not stop before the recording ends.
  constexpr DriverOptions kDriver{.overlap_m = 1e6};
  ScriptedDriver driver(path, setup.world.path_closed, kDriver, Random(setup.robot.seed + 1000));
  const auto drive = [&](const SE2& map_T_base, Duration uptime, SensorTime) -> Result<DriverDecision> {
    const VelocityCommand steady = driver.drive(map_T_base, SensorTime(uptime));
    const auto index = static_cast<std::size_t>(to_seconds(uptime) * 10);
    if (driver.done() || index >= profile.speeds.size()) return DriverDecision{.done = true};
    const double speed = std::abs(profile.speeds[index].speed_m_s);
    const double curvature = steady.speed_m_s > 0 ? steady.yaw_rate_rad_s / steady.speed_m_s : 0;
    return DriverDecision{.command = {speed, speed * curvature}};
  };
  return drive_lap(setup, drive, listener, profile.duration_s + 60);
}

}  // namespace

Result<RecordingProfile> simulate_like(const RobotSetup& setup, const RecordingProfile& like,
                                       const SimulateLikeJob& job, const JobControl& control) {
  Result<SampleRecorder> recorder = start_recording(
      job.output, {.verb = "simulate", .driver = "like", .options = "like: " + yaml_text(job.like) + "\n"},
      setup);
  if (!recorder) return tl::unexpected(recorder.error());
  RecordingProfiler profiler;
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) -> Status {
    profiler.add(sample);
    if (const auto* frame = std::get_if<TagFrame>(&sample))
      control.progress({.text = fmt::format("{:.1f} of {:.1f} s", to_seconds(frame->stamp.time_since_epoch()),
                                            like.duration_s)});
    return recorder->add(sample);
  };
  listener.should_stop = control.cancelled;
  const auto end = drive_like(setup.simulated, like, listener);
  const Status closed = recorder->close();
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  RecordingProfile made = profiler.profile();
  made.image_arrival_delay_s = image_latency_of(job.output, silent(control));
  return made;
}

}  // namespace waymark
