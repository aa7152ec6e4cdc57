#include "waymark/app/common/profile_table.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {
namespace {

bool of_a_camera(const Sample& sample) {
  return std::holds_alternative<TagFrame>(sample) || std::holds_alternative<TagPoseFrame>(sample) ||
         std::holds_alternative<CameraFrame>(sample);
}

/// Delay between the timestamp and the log time of each camera sample on a topic; empty unless each message
/// contains exactly one sample.
std::vector<double> delays_of(MessageLog& log, const std::string& topic) {
  LogSelection selection;
  selection.topics.insert(topic);
  std::vector<double> stamps;
  std::vector<double> times;
  const Status samples = log.visit_samples(selection, [&](const Sample& sample) {
    if (of_a_camera(sample)) stamps.push_back(to_seconds(stamp_of(sample).time_since_epoch()));
    return Status{};
  });
  const Status messages = log.visit(selection, [&](const LogChannel&, const LogMessage& message) {
    times.push_back(static_cast<double>(message.log_time) * 1e-9);
    return Status{};
  });
  if (!samples || !messages || times.size() != stamps.size()) return {};
  for (std::size_t i = 0; i < times.size(); ++i) times[i] -= stamps[i];
  return times;
}

std::optional<double> image_latency(MessageLog& log) {
  constexpr std::size_t kMinSamples = 20;
  constexpr double kMinLatency_s = 1e-6;  // if the latency is lower, the log time is the timestamp
  std::vector<double> most;
  for (const LogChannel& channel : log.channels()) {
    std::vector<double> delays = delays_of(log, channel.topic);
    if (delays.size() > most.size()) most = std::move(delays);
  }
  if (most.size() < kMinSamples) return std::nullopt;
  const double usual_s = median(std::move(most));
  return usual_s < kMinLatency_s ? std::nullopt : std::optional(usual_s);
}

}  // namespace

std::optional<double> image_latency_of(const std::string& path, const JobControl& control) {
  const auto log = open_log(path, control.log_options());
  return log ? image_latency(**log) : std::nullopt;
}

Result<RecordingProfile> profile_of(const std::string& path, const JobControl& control) {
  const auto log = open_recording(path, control);
  if (!log) return tl::unexpected(log.error());
  RecordingProfiler profiler;
  const Status status = (*log)->visit_samples({}, [&](const Sample& sample) -> Status {
    if (Status going = control.go_on(); !going) return going;
    profiler.add(sample);
    return {};
  });
  if (!status) return tl::unexpected(status.error());
  RecordingProfile profile = profiler.profile();
  if (profile.streams["odometry"].samples < 2)
    return fail(ErrorCode::NotFound, "the recording contains no odometry, so its speeds are unknown",
                {.source = path}, "`waymark info` lists its contents.");
  profile.image_arrival_delay_s = image_latency(**log);
  return profile;
}

std::vector<ProfileRow> profile_table(const RecordingProfile& like, const RecordingProfile& made) {
  std::vector<ProfileRow> rows;
  const auto add = [&](std::string key, std::string words, const auto& value) {
    rows.push_back({std::move(key), std::move(words), value(like), value(made)});
  };
  const auto rate = [](const std::string& kind, auto member) {
    return [=](const RecordingProfile& p) -> std::optional<double> {
      const auto stream = p.streams.find(kind);
      if (stream == p.streams.end() || stream->second.samples < 2) return std::nullopt;
      return stream->second.*member;
    };
  };
  const auto of = [](auto member) {
    return [=](const RecordingProfile& p) -> std::optional<double> { return p.*member; };
  };
  add("duration_s", "duration [s]", of(&RecordingProfile::duration_s));
  std::vector<std::string> kinds = {"camera", "odometry", "imu", "lidar", "commands"};
  for (const auto& [kind, stream] : like.streams)  // names one of several cameras: "camera left"
    if (std::ranges::find(kinds, kind) == kinds.end()) kinds.push_back(kind);
  for (const std::string& kind : kinds) {
    std::string key = kind;
    std::ranges::replace(key, ' ', '_');
    add(key + "_rate_hz", kind + " [Hz]", rate(kind, &StreamProfile::rate_hz));
    add(key + "_longest_gap_s", "  longest gap [s]", rate(kind, &StreamProfile::longest_gap_s));
  }
  add("image_latency_s", "image latency [s]", of(&RecordingProfile::image_arrival_delay_s));
  add("corner_sigma_px", "corner noise [px]", of(&RecordingProfile::corner_sigma_px));
  add("miss_probability", "tags missed between two frames", of(&RecordingProfile::miss_probability));
  add("tags_per_frame", "tags per frame", of(&RecordingProfile::tags_per_frame));
  add("gyro_noise_rad_s", "gyro noise [rad/s]", of(&RecordingProfile::gyro_noise_rad_s));
  add("gyro_bias_rad_s", "gyro bias at rest [rad/s]", of(&RecordingProfile::gyro_bias_rad_s));
  add("acceleration_noise_m_s2", "acceleration noise [m/s2]", of(&RecordingProfile::acceleration_noise_m_s2));
  add("command_delay_s", "command delay [s]", of(&RecordingProfile::command_delay_s));
  add("mean_speed_m_s", "mean speed while driving [m/s]", of(&RecordingProfile::mean_speed_m_s));
  add("p95_speed_m_s", "speed, 95th percentile [m/s]", of(&RecordingProfile::p95_speed_m_s));
  add("p95_yaw_rate_rad_s", "yaw rate, 95th percentile [rad/s]", of(&RecordingProfile::p95_yaw_rate_rad_s));
  add("standing_share", "fraction of time at rest", of(&RecordingProfile::standing_share));
  add("turning_share", "fraction of time turning on the spot", of(&RecordingProfile::turning_share));
  std::erase_if(rows, [](const ProfileRow& row) { return !row.recording && !row.simulation; });
  return rows;
}

ReportFields fields(const ProfileReport& report) {
  ReportFields quantities;
  for (const ProfileRow& row : report.rows)
    quantities.push_back({row.key,
                          {},
                          ReportFields{{"recording", "Value of the imitated recording", row.recording},
                                       {"simulation", "Value of the simulated recording", row.simulation}}});
  return {{"file", "Recording that was written", report.file},
          {"quantities", "By quantity: recording and simulation, each a number, or null if not measured",
           quantities}};
}

namespace {

double rate_of(const RecordingProfile& profile, const std::string& kind, double usual, double low) {
  const auto stream = profile.streams.find(kind);
  const double rate = stream == profile.streams.end() ? 0 : stream->second.rate_hz;
  return rate > 0 ? std::clamp(rate, low, 200.0) : usual;
}

}  // namespace

SimulatedRobotOptions options_like(const RecordingProfile& profile, SimulatedRobotOptions options) {
  options.camera_rate_hz = rate_of(profile, "camera", options.camera_rate_hz, 0.1);
  options.odometry_rate_hz = rate_of(profile, "odometry", options.odometry_rate_hz, 1);
  options.imu_rate_hz = rate_of(profile, "imu", options.imu_rate_hz, 1);
  if (options.lidar.rate_hz > 0)
    options.lidar.rate_hz = rate_of(profile, "lidar", options.lidar.rate_hz, 0.1);
  const auto take = [](const std::optional<double>& measured, double& value) {
    if (measured) value = *measured;
  };
  take(profile.gyro_noise_rad_s, options.sensors.gyro_noise_rad_s);
  take(profile.gyro_bias_rad_s, options.sensors.gyro_bias_rad_s);
  take(profile.acceleration_noise_m_s2, options.sensors.acceleration_noise_m_s2);
  take(profile.miss_probability, options.tag_camera.miss_probability);
  if (profile.corner_sigma_px) {
    options.tag_camera.corner_sigma_px = *profile.corner_sigma_px;
    options.tag_camera.small_tag_sigma_px = 0;  // the measured noise already includes it
  }
  take(profile.image_arrival_delay_s, options.camera_latency_s);
  options.camera_latency_s = std::clamp(options.camera_latency_s, 0.0, 10.0);
  // The measured delay is the sum of the command delay and the motor lag; at most half of it is attributed to
  // the lag.
  if (profile.command_delay_s) {
    options.dynamics.speed_lag_s = std::min(options.dynamics.speed_lag_s, *profile.command_delay_s / 2);
    options.dynamics.command_delay_s = *profile.command_delay_s - options.dynamics.speed_lag_s;
  }
  // From half a period after the last sample to half a period before the next one.
  const auto lose = [&](FaultKind kind, const std::vector<Gap>& gaps, double rate_hz) {
    for (const Gap& gap : gaps)
      options.faults.push_back(
          {.kind = kind, .at_s = gap.at_s + 0.5 / rate_hz, .for_s = std::max(1e-3, gap.for_s - 1 / rate_hz)});
  };
  lose(FaultKind::CameraLost, profile.camera_gaps, options.camera_rate_hz);
  lose(FaultKind::OdometryLost, profile.odometry_gaps, options.odometry_rate_hz);
  return options;
}

std::string to_text(const std::vector<ProfileRow>& rows) {
  const auto cell = [](const std::optional<double>& value) {
    return value ? fmt::format("{:.4g}", *value) : "-";
  };
  std::string text = fmt::format("{:<40}{:>12}{:>12}\n", "", "recording", "simulation");
  for (const ProfileRow& row : rows)
    text += fmt::format("{:<40}{:>12}{:>12}\n", row.text, cell(row.recording), cell(row.simulation));
  return text;
}

}  // namespace waymark
