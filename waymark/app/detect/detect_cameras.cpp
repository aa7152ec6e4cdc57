#include "waymark/app/detect/detect_cameras.hpp"

#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/live/camera_page.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

/// Detection for one camera. If there are several cameras, each has its own thread.
class CameraDetection {
 public:
  CameraDetection(const DetectCamerasJob& job, const JobControl& control, std::mutex& mutex,
                  std::string address, LiveCamera& camera, LivePage* view)
      : job_(job), control_(control), mutex_(mutex), address_(std::move(address)), camera_(camera) {
    if (view != nullptr) page_ = std::make_unique<CameraPage>(camera, view->feed(), job.poses);
  }

  Result<CameraWatchEnd> run(const TagFinder& finder) {
    CameraWatch watch{.lens = job_.poses ? ImageLens::of(job_.poses->camera) : ImageLens::unknown()};
    if (job_.duration_s > 0) watch.duration_s = job_.duration_s;
    watch.on_image = [&](CameraImage& seen) { return take(seen); };
    watch.on_message = [&](const std::string& text) { report_text(text); };
    watch.should_stop = [&] {
      const std::lock_guard lock(mutex_);
      return control_.cancelled();
    };
    const auto end = watch_camera(camera_, finder, watch);
    if (const std::string note = end ? no_tags_note(*end, finder) : ""; !note.empty()) report_text(note);
    if (page_ == nullptr) return end;
    const auto recorded = page_->close();
    if (!recorded) return end ? tl::unexpected(recorded.error()) : end;
    if (!recorded->empty()) report_text("recorded " + *recorded);
    return end;
  }

 private:
  Status take(CameraImage& seen) {
    ImageReport report{.image = internal::name_of_image(address_, seen.frame.stamp),
                       .stamp = seen.frame.stamp,
                       .width_px = seen.frame.image.width(),
                       .height_px = seen.frame.image.height(),
                       .lens = job_.poses ? LensSource::Camera : LensSource::Unknown,
                       .detected = true,
                       .detections = seen.found.detections,
                       .refinements = seen.found.refinements};
    const PoseList poses = job_.poses ? poses_for(report, *job_.poses) : PoseList();
    if (page_ != nullptr) page_->show(seen, poses);
    const std::lock_guard lock(mutex_);
    job_.on_image(report, poses, seen.age);
    return {};
  }

  void report_text(const std::string& text) {
    if (page_ != nullptr) page_->show_message(text);
    const std::lock_guard lock(mutex_);
    control_.note(job_.addresses.size() > 1 ? address_ + ": " + text : text);
  }

  const DetectCamerasJob& job_;
  const JobControl& control_;
  std::mutex& mutex_;
  std::string address_;
  LiveCamera& camera_;
  std::unique_ptr<CameraPage> page_{};
};

}  // namespace

std::string to_text(const DetectedCamera& camera, bool several) {
  const CameraWatchEnd& end = *camera.end;
  return fmt::format(
      "{}{} in {:.1f} s, {}{}; {} skipped in favour of newer ones, {} lost by the driver, {} damaged",
      several ? camera.address + ": " : "", counted(end.images, "image"), end.seconds,
      counted(end.tags, "tag"),
      end.unreliable > 0 ? fmt::format(" ({} with unreliable corners)", end.unreliable) : "",
      end.counts.dropped, end.counts.lost, end.counts.damaged);
}

Result<std::vector<DetectedCamera>> detect_cameras(const DetectCamerasJob& job, const TagFinder& finder,
                                                   const JobControl& control) {
  std::vector<std::unique_ptr<LiveCamera>> cameras;
  std::vector<DetectedCamera> detected;
  for (const std::string& address : job.addresses) {
    auto camera = open_live_camera(address);
    if (!camera) return tl::unexpected(camera.error());
    control.note((*camera)->description());
    cameras.push_back(std::move(*camera));
    detected.push_back({.address = address});
  }
  Result<std::unique_ptr<LivePage>> view = std::unique_ptr<LivePage>();
  if (job.page) view = LivePage::start(*job.page, cameras.front()->description(), control);
  if (!view) return tl::unexpected(view.error());
  std::mutex mutex;
  const auto run = [&](std::size_t i) {
    detected[i].end =
        CameraDetection(job, control, mutex, job.addresses[i], *cameras[i], view->get()).run(finder);
  };
  std::vector<std::thread> threads;
  for (std::size_t i = 1; i < cameras.size(); ++i) threads.emplace_back(run, i);
  run(0);
  for (std::thread& thread : threads) thread.join();
  return detected;
}

Result<bool> is_camera_input(const std::vector<std::string>& sources, const GivenFields& given) {
  const auto live = are_cameras(sources);
  if (!live) return live;
  FieldRefusals refused(given);
  refused.fields(*live && sources.size() > 1, {"view", "camera"},
                 "this option supports only one camera, but several are given",
                 "Run the program once per camera.");
  refused.fields(!*live, {"view", "duration_s"}, "this option applies to live cameras", "Omit this option.");
  refused.fields(*live, {"annotate", "recursive"},
                 "this option applies to files, but the input is a live camera",
                 "Omit this option; `waymark convert` records the camera.");
  if (!refused.status()) return tl::unexpected(refused.status().error());
  return live;
}

}  // namespace waymark
