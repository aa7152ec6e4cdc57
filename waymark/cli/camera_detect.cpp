#include "waymark/cli/camera_detect.hpp"

#include <memory>
#include <utility>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/jobs/detect_pictures.hpp"
#include "waymark/jobs/detections_text.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/live/camera_address.hpp"
#include "waymark/live/camera_page.hpp"

namespace waymark::cli {
namespace {

/// One run of detect_camera(), from an opened camera on.
class CameraDetection {
 public:
  CameraDetection(const CameraDetectJob& job, Console& console, LiveCamera& camera, LivePage* view)
      : job_(job), console_(console) {
    if (view != nullptr) page_ = std::make_unique<CameraPage>(camera, view->feed(), job.poses);
  }

  Status take(CameraPicture& seen) {
    PictureReport report{.image = internal::name_of_picture(job_.address, seen.frame.stamp),
                         .stamp = seen.frame.stamp,
                         .width_px = seen.frame.image.width(),
                         .height_px = seen.frame.image.height(),
                         .detected = true,
                         .detections = seen.found.detections,
                         .refinements = seen.found.refinements};
    const PoseList poses = job_.poses ? poses_for(report, *job_.poses) : PoseList();
    if (page_ != nullptr) page_->show(seen, poses);
    print(report, poses, seen);
    if (console_.output_ended()) ended_ = true;
    return {};
  }
  void say(const std::string& words) {
    console_.say(words);
    if (page_ != nullptr) page_->say(words);
  }
  [[nodiscard]] bool ended() const { return ended_ || interrupted(); }
  Status close() {
    console_.end_progress();
    if (page_ == nullptr) return {};
    const auto recorded = page_->close();
    if (!recorded) return tl::unexpected(recorded.error());
    if (!recorded->empty()) console_.say("recorded " + *recorded);
    return {};
  }

 private:
  void print(const PictureReport& report, const PoseList& poses, const CameraPicture& seen) {
    const double age_ms = 1e3 * to_seconds(seen.age);
    if (job_.json) {
      nlohmann::ordered_json json = to_json(report, poses, job_.covariance);
      json["age_ms"] = age_ms;
      console_.print(json_line(json));
    } else if (page_ == nullptr) {
      console_.print(waymark::to_text(report) + waymark::to_text(report.detections, poses));
    } else {
      console_.live(fmt::format("{} tags, {:.0f} ms old", report.detections.size(), age_ms));
    }
  }

  const CameraDetectJob& job_;
  Console& console_;
  std::unique_ptr<CameraPage> page_{};
  bool ended_ = false;
};

}  // namespace

Result<bool> is_camera_input(const CLI::App& app, const std::vector<std::string>& sources) {
  const auto camera = is_only_camera(sources);
  if (!camera) return camera;
  const bool live = *camera;
  Status status;
  for (const char* flag : {"--view", "--duration-s"})
    if (status && !live) status = refuse_flag(app, flag, "this is about live cameras", "Leave it out.");
  for (const char* flag : {"--annotate", "--recursive"})
    if (status && live)
      status = refuse_flag(app, flag, "this is about files, and the input is a live camera",
                           "Leave it out; `waymark convert` records the camera.");
  if (!status) return tl::unexpected(status.error());
  return live;
}

ExitCode detect_camera(const CameraDetectJob& job, const TagFinder& finder, Console& console) {
  auto camera = open_live_camera(job.address);
  if (!camera) {
    const bool usage = camera.error().code == ErrorCode::InvalidArgument;
    return console.failed(camera.error(), usage ? ExitCode::Usage : ExitCode::SomeFailed);
  }
  console.say((*camera)->description());
  Result<std::unique_ptr<LivePage>> view = std::unique_ptr<LivePage>();
  if (job.view) view = LivePage::start(job.page, (*camera)->description(), control_from(console));
  if (!view) return console.failed(view.error(), ExitCode::SomeFailed);
  CameraDetection detection(job, console, **camera, view->get());
  CameraWatch watch;
  if (job.duration_s > 0) watch.duration_s = job.duration_s;
  if (job.poses) watch.camera = &job.poses->camera;
  watch.on_picture = [&](CameraPicture& seen) { return detection.take(seen); };
  watch.on_words = [&](const std::string& words) { detection.say(words); };
  watch.should_stop = [&] { return detection.ended(); };
  const auto end = watch_camera(**camera, finder, watch);
  const Status closed = detection.close();
  if (!end) return console.failed(end.error(), ExitCode::SomeFailed);
  if (!closed) return console.failed(closed.error(), ExitCode::SomeFailed);
  const CameraCounts& counts = end->counts;
  console.say(
      fmt::format("{} pictures in {:.1f} s, {} tags; {} dropped for newer ones, {} lost by the driver, "
                  "{} damaged",
                  end->pictures, end->seconds, end->tags, counts.dropped, counts.lost, counts.damaged));
  return end->stopped && interrupted() ? ExitCode::Interrupted : ExitCode::Ok;
}

}  // namespace waymark::cli
