#include "waymark/app/teach/lap_recording.hpp"

#include <algorithm>
#include <utility>

#include "waymark/app/live/start_recording.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

/// Truth of pictures, where no estimator looks.
std::string truth_topic(const std::string& camera) {
  return "/truth" + topic_of_camera(camera, topics::kTags);
}

/// The corners that are wholly in view, as if a detector without errors had found them.
TagFrame true_corners(const SeenPicture& seen) {
  TagFrame frame{.stamp = seen.found.stamp, .camera = seen.found.camera};
  for (const SceneTagTruth& tag : seen.picture.tags) {
    if (std::ranges::count(tag.corner_visible, true) < 4) continue;
    frame.detections.push_back({.tag = tag.tag, .hamming = 0, .corners_px = tag.corners_px});
  }
  return frame;
}

}  // namespace

TeachListener lap_listener(SampleRecorder& recorder, const std::string& images, const JobControl& control) {
  return {.on_sample =
              [&recorder, images](const Sample& sample) {
                const auto* picture = std::get_if<CameraFrame>(&sample);
                return picture != nullptr ? record_picture(*picture, images, recorder) : recorder.add(sample);
              },
          .on_progress = [&control](const std::string& line) { control.progress({.words = line}); },
          .on_words = [&control](const std::string& words) { control.note(words); }};
}

Status record_rendered(const SeenPicture& seen, const std::string& images, SampleRecorder& recorder) {
  Status status = recorder.add_message(truth_topic(seen.found.camera), seen.found.stamp,
                                       ros2::to_ros(true_corners(seen)));
  if (!status || images.empty()) return status;
  return record_picture({.stamp = seen.found.stamp, .camera = seen.found.camera, .image = seen.picture.image},
                        images, recorder);
}

LapMonitor lap_of(const SimulatedSetup& setup, TeachListener listener) {
  const auto exposure_ms = setup.pictures ? std::optional(setup.pictures->camera.exposure_ms) : std::nullopt;
  return {teach_setup(setup), monitor_options(setup.camera, exposure_ms), std::move(listener)};
}

TeachReport report_of(const LapMonitor& lap, const LapEnd& end, const Stopwatch& watch) {
  return {.summary = lap.summary(),
          .end = end,
          .worst_blur_px = lap.monitor().worst_blur_px(),
          .blurred_frames = lap.monitor().blurred_frames(),
          .abrupt_moments = lap.monitor().abrupt_moments(),
          .wall_s = watch.seconds()};
}

}  // namespace waymark
