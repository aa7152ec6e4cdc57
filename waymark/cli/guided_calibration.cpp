#include "waymark/cli/guided_calibration.hpp"

#include <algorithm>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/jobs/detect_all.hpp"
#include "waymark/live/camera_address.hpp"
#include "waymark/live/camera_page.hpp"
#include "waymark/live/camera_watch.hpp"

namespace waymark::cli {
namespace {

/// Tells how far the calibration is: each view on a line, and once a second what is missing.
class Teller {
 public:
  Teller(const GuidedCalibration& guided, Console& console) : guided_(guided), console_(console) {}

  /// After each picture; whether something was told.
  bool tell(SensorTime stamp, bool is_view) {
    constexpr Duration kPeriod = std::chrono::seconds(1);
    if (!is_view && last_ && stamp >= *last_ && stamp - *last_ < kPeriod) return false;
    last_ = stamp;
    const std::string words = to_text(guided_.status());
    if (is_view)
      console_.say(words);
    else
      console_.live(words);
    return true;
  }

 private:
  const GuidedCalibration& guided_;
  Console& console_;
  std::optional<SensorTime> last_{};
};

/// What changes by itself would change the lens or the noise between two views: it is held, and told.
void lock_controls(LiveCamera& camera, Console& console) {
  std::vector<std::string> locked;
  for (const CameraControl& control : camera.controls()) {
    if (!control.automatic) continue;
    const Status set = camera.set_control(control.name, control.value);
    if (set)
      locked.push_back(control.name);
    else
      console.say(fmt::format("{} stays automatic: {}", control.name, to_string(set.error())));
  }
  if (!locked.empty())
    console.say(fmt::format("automatic until now, held from here on: {}", fmt::join(locked, ", ")));
}

Status from_camera(const GuidedRun& run, GuidedCalibration& guided, Console& console) {
  auto camera = open_live_camera(run.job.sources.front());
  if (!camera) return tl::unexpected(camera.error());
  console.say((*camera)->description());
  lock_controls(**camera, console);
  Result<std::unique_ptr<LivePage>> view = std::unique_ptr<LivePage>();
  if (run.view) view = LivePage::start(run.page, (*camera)->description(), control_from(console));
  if (!view) return tl::unexpected(view.error());
  const std::optional<PoseSetup> no_poses;
  std::unique_ptr<CameraPage> page;
  if (*view != nullptr) page = std::make_unique<CameraPage>(**camera, (*view)->feed(), no_poses);
  Teller teller(guided, console);
  CameraWatch watch;
  watch.on_picture = [&](CameraPicture& seen) -> Status {
    const auto taken = guided.take(seen.frame.stamp, seen.frame.image);
    if (!taken) return tl::unexpected(taken.error());
    const bool told = teller.tell(seen.frame.stamp, *taken);
    if (page != nullptr && told) page->say(to_text(guided.status()));
    if (page != nullptr) page->show(seen, {});
    return {};
  };
  watch.on_words = [&](const std::string& words) { console.say(words); };
  watch.should_stop = [&] { return interrupted() || guided.status().good_enough; };
  const TagFinder nothing = no_tags();
  const auto end = watch_camera(**camera, nothing, watch);
  console.end_progress();
  if (page != nullptr)
    if (const auto closed = page->close(); !closed) return tl::unexpected(closed.error());
  return end ? Status() : Status(tl::unexpected(end.error()));
}

Status from_files(const GuidedRun& run, GuidedCalibration& guided, Console& console) {
  Status status;
  Teller teller(guided, console);
  const TagFinder nothing = no_tags();
  const DetectSummary summary = detect_all(
      find_inputs(run.job.sources, run.job.recursive), nothing, control_from(console),
      [&](std::size_t index, const PictureReport& report, const ImageView& image) {
        if (!report.detected) return true;
        const auto taken = guided.take(report.stamp.value_or(SensorTime(std::chrono::seconds(index))), image);
        if (!taken) {
          status = tl::unexpected(taken.error());
          return false;
        }
        static_cast<void>(teller.tell(report.stamp.value_or(SensorTime()), *taken));
        return !guided.status().good_enough;
      });
  console.end_progress();
  if (status && summary.pictures == 0) return fail(ErrorCode::NotFound, "no picture could be read");
  return status;
}

}  // namespace

Result<bool> is_live_source(const std::vector<std::string>& sources) {
  const bool live = sources.size() == 1 && is_camera_address(sources.front());
  if (!live && std::ranges::any_of(sources, is_camera_address))
    return fail(ErrorCode::InvalidArgument, "a live camera is the only input", {},
                "Run the program once for each camera.");
  return live;
}

Result<CalibrateCameraReport> calibrate_guided(const GuidedRun& run, Console& console) {
  GuidedCalibration guided(run.job, run.target, run.finder, run.options, run.folder);
  const auto resumed = guided.resume(control_from(console));
  if (!resumed) return tl::unexpected(resumed.error());
  if (*resumed > 0) console.say(fmt::format("{}: {} views from before", run.folder, *resumed));
  const auto live = is_live_source(run.job.sources);
  if (!live) return tl::unexpected(live.error());
  const Status taken = *live ? from_camera(run, guided, console) : from_files(run, guided, console);
  if (!taken) return tl::unexpected(taken.error());
  console.say(to_text(guided.status()));
  return guided.finish();
}

}  // namespace waymark::cli
