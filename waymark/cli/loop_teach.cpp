#include <algorithm>
#include <chrono>

#include <sys/resource.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/cli/human_driver.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/lesson.hpp"
#include "waymark/cli/loop_steps.hpp"
#include "waymark/config/yaml_fields.hpp"

namespace waymark::cli {
namespace {

std::int64_t now_ns() {
  const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since_start).count();
}

/// What a recording says of how it was driven and seen.
std::string making_yaml(const SimulatedStage& stage, const TeachJob& job, const DriverOptions& driver) {
  std::string yaml =
      "driver:\n" +
      (job.driver == "scripted" ? write_fields(driver, 2) : fmt::format("  speed_m_s: {}\n", job.speed_m_s));
  if (stage.pictures)
    yaml += "camera:\n" + write_fields(stage.pictures->camera, 2) + "scene:\n" +
            write_fields(stage.pictures->scene, 2) + "detector:\n" +
            write_fields(stage.pictures->detector, 2);
  return yaml;
}

/// Nothing when nobody is needed.
Result<std::unique_ptr<HumanDriver>> human_of(const TeachJob& job) {
  if (job.driver == "scripted") return std::unique_ptr<HumanDriver>();
  return HumanDriver::make(job.driver, job.speed_m_s);
}

Result<LapEnd> drive(const SimulatedStage& stage, HumanDriver* human, const DriverOptions& driver,
                     const LapListener& listener, Console& console) {
  if (human == nullptr) return drive_scripted_lap(stage, driver, listener);
  constexpr double kAnHour = 3600;
  console.say(human->usage());
  return drive_lap(
      stage,
      [&](const SE2& /*map_T_base*/, Duration uptime, SensorTime now) { return human->drive(uptime, now); },
      listener, kAnHour);
}

}  // namespace

Stopwatch::Stopwatch() : start_ns_(now_ns()) {}
double Stopwatch::seconds() const { return static_cast<double>(now_ns() - start_ns_) * 1e-9; }

double peak_rss_mib() {
  rusage usage{};
  return getrusage(RUSAGE_SELF, &usage) == 0 ? static_cast<double>(usage.ru_maxrss) / 1024 : 0;
}

TeachReport report_of(const Lesson& lesson, const LapEnd& end, const Stopwatch& watch) {
  return {.summary = lesson.summary(),
          .end = end,
          .worst_blur_px = lesson.monitor().worst_blur_px(),
          .blurred_frames = lesson.monitor().blurred_frames(),
          .abrupt_moments = lesson.monitor().abrupt_moments(),
          .wall_s = watch.seconds()};
}

std::vector<std::string> teach_drivers() { return {"scripted", "keyboard", "gamepad"}; }

Result<TeachReport> teach_lap(const Stage& stage, const TeachJob& job, Console& console) {
  const Stopwatch watch;
  const SimulatedStage& simulated = stage.simulated;
  const DriverOptions driver{.speed_m_s = job.speed_m_s,
                             .second_speed_m_s = job.second_speed_m_s,
                             .lateral_wander_m = job.wander_m,
                             .wander_time_s = job.wander_time_s,
                             .overlap_m = job.overlap_m};
  const auto human = human_of(job);
  if (!human) return tl::unexpected(human.error());
  Result<SampleRecorder> recorder = start_recording(job.output,
                                                    {.verb = "teach",
                                                     .driver = job.driver,
                                                     .options = making_yaml(simulated, job, driver),
                                                     .durable = job.durable},
                                                    stage);
  if (!recorder) return tl::unexpected(recorder.error());
  Lesson lesson(teach_setup(simulated), monitor_options(simulated), job.images, *recorder, console);
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) { return lesson.on_sample(sample); };
  listener.on_picture = [&](const SeenPicture& seen) { return lesson.on_picture(seen); };
  listener.should_stop = [] { return interrupted(); };
  const auto end = drive(simulated, human->get(), driver, listener, console);
  const Status closed = recorder->close();
  console.end_progress();
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  return report_of(lesson, *end, watch);
}

nlohmann::ordered_json links_json(const TeachSummary& summary) {
  auto links = nlohmann::ordered_json::array();
  for (const TagLink& link : summary.weak_links)
    links.push_back({{"tags", {to_string(link.first), to_string(link.second)}}, {"frames", link.frames}});
  return links;
}

nlohmann::ordered_json to_json(const TeachReport& report, const std::string& file) {
  const TeachSummary& s = report.summary;
  return {{"file", file},
          {"wall_s", report.wall_s},
          {"lap_s", report.end.lap_s},
          {"frames", s.frames},
          {"detections", s.detections},
          {"tags", s.seen.size()},
          {"low_observability_frames", s.low_observability_frames},
          {"two_tags_fraction", s.two_tags_fraction()},
          {"longest_blind_s", s.longest_blind_s},
          {"longest_silence_s", s.longest_silence_s},
          {"clock_back_s", s.clock_back_s},
          {"distance_m", s.distance_m},
          {"worst_blur_px", report.worst_blur_px},
          {"blurred_frames", report.blurred_frames},
          {"abrupt_moments", report.abrupt_moments},
          {"weak_links", links_json(s)},
          {"closed_loop", s.closed_loop},
          {"mappable", s.mappable},
          {"finished", report.end.finished},
          {"warnings", s.warnings}};
}

}  // namespace waymark::cli
