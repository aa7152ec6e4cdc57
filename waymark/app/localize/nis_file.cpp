// What a recording of `waymark localize` says beside its poses.
#include <charconv>
#include <limits>

#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/common/trajectory_files.hpp"
#include "waymark/recording/cdr.hpp"
#include "waymark/recording/log_formats.hpp"
#include "waymark/recording/logged_poses.hpp"
#include "waymark/recording/ros2_convert.hpp"
#include "waymark/recording/ros2_messages.hpp"

namespace waymark {
namespace {

std::optional<double> number_of(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// NIS over its degrees of freedom; nothing when the status does not say both.
std::optional<double> nis_of(const ros2::DiagnosticStatus& status) {
  std::optional<double> nis;
  std::optional<double> freedom;
  for (const auto& value : status.values) {
    if (value.key == "nis") nis = number_of(value.value);
    if (value.key == "degrees_of_freedom") freedom = number_of(value.value);
  }
  if (!nis || !freedom || !(*freedom > 0)) return std::nullopt;
  return *nis / *freedom;
}

}  // namespace

std::optional<NisSummary> read_nis(const std::string& path, SensorTime from, SensorTime to,
                                   const JobControl& control) {
  if (!looks_like_recording(path)) return std::nullopt;
  const auto log = open_log(path, control.log_options());
  if (!log) return std::nullopt;
  NisSummary all;
  double sum = 0;
  const Status read = (*log)->visit({.topics = {kNisTopic}},
                                    [&](const LogChannel& channel, const LogMessage& message) -> Status {
                                      if (channel.type != ros2::DiagnosticArray::kType) return {};
                                      const auto array = cdr::decode<ros2::DiagnosticArray>(message.data);
                                      if (!array) return {};
                                      const SensorTime stamp = ros2::from_ros(array->header.stamp);
                                      if (stamp < from || stamp > to) return {};
                                      for (const ros2::DiagnosticStatus& status : array->status) {
                                        const auto nis = nis_of(status);
                                        if (!nis) continue;
                                        const bool accepted = status.level == 0;
                                        sum += accepted ? *nis : 0;
                                        ++(accepted ? all.observations : all.rejected);
                                      }
                                      return {};
                                    });
  if (!read || all.observations + all.rejected == 0) return std::nullopt;
  if (all.observations > 0) all.mean = sum / static_cast<double>(all.observations);
  return all;
}

std::size_t count_uncertain(const std::string& path, SensorTime from, SensorTime to,
                            const JobControl& control) {
  if (!looks_like_recording(path)) return 0;
  const auto log = open_log(path, control.log_options());
  if (!log || (*log)->format() != LogFormat::Mcap) return 0;
  std::size_t count = 0;
  std::vector<LogProblem> problems;
  const Status read = visit_poses(
      **log, kUncertainTopic, {},
      [&](const EstimatedPose& pose) -> Status {
        if (pose.stamp >= from && pose.stamp <= to) ++count;
        return {};
      },
      problems);
  return read ? count : 0;
}

}  // namespace waymark
