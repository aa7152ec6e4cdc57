#include "waymark/app/replay/replay_notes.hpp"

#include <fmt/format.h>

#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/messages.hpp"

namespace waymark {
namespace {

ros2::DiagnosticArray message_of(SensorTime now, const ReplayStep& step) {
  constexpr std::uint8_t kOk = 0;
  constexpr std::uint8_t kWarn = 1;
  const bool stands = step.state == ReplayState::Stopped || step.state == ReplayState::Refused;
  ros2::DiagnosticArray message;
  message.header = {.stamp = ros2::to_ros(now), .frame_id = std::string(ros2::kMapFrame)};
  ros2::DiagnosticStatus status{.level = stands ? kWarn : kOk, .name = "waymark replay"};
  status.message = std::string(to_string(step.state));
  if (step.reason) status.message += ": " + *step.reason;
  status.values.push_back({"driven_m", fmt::format("{:.3f}", step.driven_m)});
  if (step.station) status.values.push_back({"station", step.station->name});
  message.status.push_back(std::move(status));
  return message;
}

}  // namespace

void ReplayNotes::note_station(SensorTime now, const ReplayStep& step) {
  if (last_ == ReplayState::AtStation) {
    if (step.state != ReplayState::Stopped)
      control_.note(fmt::format("goes on from '{}'", visits_.back().name));
  }
  if (step.state != ReplayState::AtStation) return;
  const Station& station = *step.station;
  visits_.push_back({.name = station.name, .arc_length_m = station.arc_length_m, .arrived = now});
  control_.note(fmt::format("at '{}', {:.2f} m along the route: stands for {:g} s", station.name,
                            station.arc_length_m, station.pause_s));
}

Status ReplayNotes::add(SensorTime now, const ReplayStep& step, SampleRecorder* recorder) {
  const std::string station = step.station ? step.station->name : std::string();
  if (last_ == ReplayState::AtStation) visits_.back().stood_s = to_seconds(now - visits_.back().arrived);
  if (last_ == step.state && station == last_station_) return {};
  note_station(now, step);
  last_ = step.state;
  last_station_ = station;
  return recorder != nullptr ? recorder->add_message(topics::kDiagnostics, now, message_of(now, step))
                             : Status();
}

}  // namespace waymark
