#include <algorithm>
#include <chrono>

#include <sys/resource.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/cli/human_driver.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/loop_steps.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/pipeline/teach_monitor.hpp"

namespace waymark::cli {
namespace {

std::int64_t now_ns() {
  const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since_start).count();
}

/// Truth of pictures, where no estimator looks.
constexpr const char* kTruthTags = "/truth/tag_detections";
constexpr const char* kCompressed = "/image_raw/compressed";
constexpr int kJpegQuality = 92;

TeachMonitorOptions monitor_options(const SimulatedStage& stage) {
  TeachMonitorOptions options;
  if (stage.pictures) options.exposure_ms = stage.pictures->camera.exposure_ms;
  // Pixels a radian in the middle of the picture, whatever the model.
  const auto ahead = stage.camera.project(Eigen::Vector3d(0, 0, 1));
  const auto beside = stage.camera.project(Eigen::Vector3d(1e-3, 0, 1));
  if (ahead && beside) options.focal_length_px = std::max(1.0, (*beside - *ahead).norm() / 1e-3);
  return options;
}

/// The corners that are wholly in view, as if a detector without errors had found them.
TagFrame true_corners(const SeenPicture& seen) {
  TagFrame frame{.stamp = seen.found.stamp};
  for (const SceneTagTruth& tag : seen.picture.tags) {
    if (std::ranges::count(tag.corner_visible, true) < 4) continue;
    frame.detections.push_back({.tag = tag.tag, .hamming = 0, .corners_px = tag.corners_px});
  }
  return frame;
}

/// The samples of a lap on their way into the file and past the teacher.
class Lesson {
 public:
  Lesson(const SimulatedStage& stage, std::string images, SampleRecorder& recorder, Console& console)
      : teacher_(teach_setup(stage)),
        monitor_(monitor_options(stage)),
        images_(std::move(images)),
        recorder_(recorder),
        console_(console) {}

  Status on_sample(const Sample& sample) {
    monitor_.add(sample);
    if (const auto* frame = std::get_if<TagFrame>(&sample)) {
      teacher_.watch(*frame);
      console_.live(live_words(*frame));
    }
    if (const auto* odometry = std::get_if<Odometry>(&sample)) teacher_.add(*odometry);
    return recorder_.add(sample);
  }
  Status on_picture(const SeenPicture& seen) {
    Status status = recorder_.add_message(kTruthTags, seen.found.stamp, ros2::to_ros(true_corners(seen)));
    if (!status || images_.empty()) return status;
    const Image& image = seen.picture.image;
    if (images_ == "raw") return recorder_.add(CameraFrame{.stamp = seen.found.stamp, .image = image});
    auto bytes = encode_jpeg(image, kJpegQuality);
    if (!bytes) return tl::unexpected(bytes.error());
    ros2::CompressedImage message;
    message.header = ros2::to_ros(CameraFrame{.stamp = seen.found.stamp}).header;
    message.format = "jpeg";
    message.data = std::move(*bytes);
    return recorder_.add_message(kCompressed, seen.found.stamp, message);
  }
  [[nodiscard]] TeachSummary summary() const {
    TeachSummary summary = teacher_.summary();
    for (std::string& words : monitor_.summary()) summary.warnings.push_back(std::move(words));
    return summary;
  }
  [[nodiscard]] const TeachMonitor& monitor() const { return monitor_; }

 private:
  [[nodiscard]] std::string live_words(const TagFrame& frame) const {
    std::string words =
        fmt::format("{:.1f} s, {} tags", to_seconds(frame.stamp.time_since_epoch()), frame.detections.size());
    for (const std::string& warning : monitor_.live()) words += "; " + warning;
    return words + ". Ctrl-C stops the robot.";
  }

  Teacher teacher_;
  TeachMonitor monitor_;
  std::string images_;
  SampleRecorder& recorder_;
  Console& console_;
};

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

Result<SimulatedLapEnd> drive(const SimulatedStage& stage, HumanDriver* human, const DriverOptions& driver,
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

std::vector<std::string> teach_drivers() { return {"scripted", "keyboard", "gamepad"}; }

Result<TeachReport> teach_lap(const Stage& stage, const TeachJob& job, Console& console) {
  const Stopwatch watch;
  const SimulatedStage& simulated = stage.simulated;
  const DriverOptions driver{.speed_m_s = job.speed_m_s};
  const auto human = human_of(job);
  if (!human) return tl::unexpected(human.error());
  Result<SampleRecorder> recorder = start_recording(job.output,
                                                    {.verb = "teach",
                                                     .driver = job.driver,
                                                     .options = making_yaml(simulated, job, driver),
                                                     .durable = job.durable},
                                                    stage);
  if (!recorder) return tl::unexpected(recorder.error());
  Lesson lesson(simulated, job.images, *recorder, console);
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) { return lesson.on_sample(sample); };
  listener.on_picture = [&](const SeenPicture& seen) { return lesson.on_picture(seen); };
  listener.should_stop = [] { return interrupted(); };
  const auto end = drive(simulated, human->get(), driver, listener, console);
  const Status closed = recorder->close();
  console.end_progress();
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  return TeachReport{.summary = lesson.summary(),
                     .end = *end,
                     .worst_blur_px = lesson.monitor().worst_blur_px(),
                     .blurred_frames = lesson.monitor().blurred_frames(),
                     .abrupt_moments = lesson.monitor().abrupt_moments(),
                     .wall_s = watch.seconds()};
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
