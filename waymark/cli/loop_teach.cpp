#include <chrono>

#include <sys/resource.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/loop_steps.hpp"
#include "waymark/config/yaml_fields.hpp"

namespace waymark::cli {
namespace {

std::int64_t now_ns() {
  const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since_start).count();
}

/// The samples of a lap on their way into the file and past the teacher.
class Lesson {
 public:
  Lesson(const SimulatedStage& stage, SampleRecorder& recorder, Console& console)
      : teacher_(teach_setup(stage)), recorder_(recorder), console_(console) {}

  Status on_sample(const Sample& sample) {
    if (const auto* frame = std::get_if<TagFrame>(&sample)) {
      const TaughtFrame taught = teacher_.add(*frame);
      console_.live(fmt::format("{:.1f} s, {} tags{}. Ctrl-C stops the robot.",
                                to_seconds(frame->stamp.time_since_epoch()), taught.observed.tags.size(),
                                taught.low_observability ? ": too few" : ""));
    }
    if (const auto* odometry = std::get_if<Odometry>(&sample)) teacher_.add(*odometry);
    return recorder_.add(sample);
  }
  [[nodiscard]] TeachSummary summary() const { return teacher_.summary(); }

 private:
  Teacher teacher_;
  SampleRecorder& recorder_;
  Console& console_;
};

}  // namespace

Stopwatch::Stopwatch() : start_ns_(now_ns()) {}
double Stopwatch::seconds() const { return static_cast<double>(now_ns() - start_ns_) * 1e-9; }

double peak_rss_mib() {
  rusage usage{};
  return getrusage(RUSAGE_SELF, &usage) == 0 ? static_cast<double>(usage.ru_maxrss) / 1024 : 0;
}

Result<TeachReport> teach_lap(const Stage& stage, const std::string& output, Console& console) {
  const Stopwatch watch;
  const DriverOptions driver;
  Result<SampleRecorder> recorder = start_recording(
      output, {.verb = "teach", .driver = "scripted", .options = "driver:\n" + write_fields(driver, 2)},
      stage);
  if (!recorder) return tl::unexpected(recorder.error());
  Lesson lesson(stage.simulated, *recorder, console);
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) { return lesson.on_sample(sample); };
  listener.should_stop = [] { return interrupted(); };
  const auto end = drive_scripted_lap(stage.simulated, driver, listener);
  const Status closed = recorder->close();
  console.end_progress();
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  return TeachReport{.summary = lesson.summary(), .end = *end, .wall_s = watch.seconds()};
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
          {"distance_m", s.distance_m},
          {"closed_loop", s.closed_loop},
          {"mappable", s.mappable},
          {"finished", report.end.finished},
          {"warnings", s.warnings}};
}

}  // namespace waymark::cli
