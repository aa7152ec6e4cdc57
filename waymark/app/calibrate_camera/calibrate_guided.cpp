#include "waymark/app/calibrate_camera/calibrate_guided.hpp"

#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/detect_all.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/image_files.hpp"
#include "waymark/app/live/camera_page.hpp"
#include "waymark/app/live/cameras.hpp"

namespace waymark {
namespace {

/// Reports the state of the calibration: one line per view, and once per second the views that are still
/// missing.
class StatusReporter {
 public:
  StatusReporter(const GuidedCalibration& guided, const JobControl& control)
      : guided_(guided), control_(control) {}

  /// Call this after each image. Returns whether anything was reported.
  bool report(SensorTime stamp, bool is_view) {
    constexpr Duration kPeriod = std::chrono::seconds(1);
    if (!is_view && last_ && stamp >= *last_ && stamp - *last_ < kPeriod) return false;
    last_ = stamp;
    const std::string text = to_text(guided_.status());
    const bool absent = !guided_.status().absence.empty();
    if (is_view || absent != std::exchange(absent_, absent))
      control_.note(text);
    else
      control_.progress({text});
    return true;
  }

 private:
  const GuidedCalibration& guided_;
  const JobControl& control_;
  std::optional<SensorTime> last_{};
  bool absent_ = false;  ///< whether the last report was that no image shows the board
};

/// Locks automatic controls, with a note, because they would change the lens or the noise between views.
void lock_controls(LiveCamera& camera, const JobControl& control) {
  std::vector<std::string> locked;
  for (const CameraControl& each : camera.controls()) {
    if (!each.automatic) continue;
    const Status set = camera.set_control(each.name, each.value);
    if (set)
      locked.push_back(each.name);
    else
      control.note(fmt::format("{} remains automatic: {}", each.name, to_string(set.error())));
  }
  if (!locked.empty())
    control.note(fmt::format("fixed these automatic controls: {}", fmt::join(locked, ", ")));
}

Status from_camera(const CalibrateGuidedJob& job, GuidedCalibration& guided, const JobControl& control) {
  auto camera = open_live_camera(job.sources.front());
  if (!camera) return tl::unexpected(camera.error());
  control.note((*camera)->description());
  lock_controls(**camera, control);
  Result<std::unique_ptr<LivePage>> view = std::unique_ptr<LivePage>();
  if (job.view) view = LivePage::start(job.page, (*camera)->description(), control);
  if (!view) return tl::unexpected(view.error());
  const std::optional<PoseSetup> no_poses;
  std::unique_ptr<CameraPage> page;
  if (*view != nullptr) page = std::make_unique<CameraPage>(**camera, (*view)->feed(), no_poses);
  StatusReporter reporter(guided, control);
  CameraWatch watch{.lens = ImageLens::unknown()};
  watch.on_image = [&](CameraImage& seen) -> Status {
    const auto taken = guided.take(seen.frame.stamp, seen.frame.image);
    if (!taken) return tl::unexpected(taken.error());
    const bool reported = reporter.report(seen.frame.stamp, *taken);
    if (page == nullptr) return {};
    if (reported) page->show_message(to_text(guided.status()));
    page->guide(to_json(fields(guided.status())), *taken);
    page->show(seen, {});
    return {};
  };
  watch.on_message = [&](const std::string& text) { control.note(text); };
  watch.should_stop = [&] { return control.cancelled() || guided.status().good_enough; };
  const TagFinder nothing = no_tags();
  const auto end = watch_camera(**camera, nothing, watch);
  if (page != nullptr)
    if (const auto closed = page->close(); !closed) return tl::unexpected(closed.error());
  return end ? Status() : Status(tl::unexpected(end.error()));
}

Status from_files(const CalibrateGuidedJob& job, GuidedCalibration& guided, const JobControl& control) {
  Status status;
  StatusReporter reporter(guided, control);
  const TagFinder nothing = no_tags();
  const LensChoice unknown{.camera = ImageLens::unknown(), .use_recorded = false};
  const DetectSummary summary = detect_all(
      find_inputs(job.sources, job.recursive), nothing, unknown, control,
      [&](std::size_t index, const ImageReport& report, const ImageView& image) {
        if (!report.detected) return true;
        const auto taken = guided.take(report.stamp.value_or(SensorTime(std::chrono::seconds(index))), image);
        if (!taken) {
          status = tl::unexpected(taken.error());
          return false;
        }
        static_cast<void>(reporter.report(report.stamp.value_or(SensorTime()), *taken));
        return !guided.status().good_enough;
      });
  if (status && summary.images == 0) return fail(ErrorCode::NotFound, "no image could be read");
  return status;
}

/// Fails if an input is not an image sequence.
Status check_sequences(const CalibrateGuidedJob& job) {
  for (const Input& input : find_inputs(job.sources, job.recursive)) {
    if (input.error) continue;
    const FileKind kind = kind_of(input.path);
    if (kind == FileKind::Video || is_recording(kind)) continue;
    return or_wrong_kind(
        Status(fail(ErrorCode::InvalidArgument,
                    "a guided calibration takes its views from a live camera, a video or a recording",
                    {.source = input.path}, "For single images, use `waymark calibrate camera`.")),
        input.path, FileUse::Video);
  }
  return {};
}

}  // namespace

Status check_job(const CalibrateGuidedJob& job, const GivenFields& given) {
  const auto live = is_only_camera(job.sources);
  if (!live) return tl::unexpected(live.error());
  FieldRefusals refused(given);
  refuse_without_output(job.fit, refused);
  refuse_of_other_targets(job.target, refused);
  refused.fields(!*live, {"view"}, "this option applies to live cameras", "Omit this option.");
  if (!refused.status()) return refused.status();
  if (job.sources.empty())
    return fail(
        ErrorCode::InvalidArgument, "no camera, video or recording is given",
        {.key = job.folder.empty() ? "" : "resume"},
        "Give a live camera, such as v4l2:/dev/video0, or a video. To use only the views of an earlier "
        "calibration, pass their folder to `waymark calibrate camera`.");
  return *live ? Status() : check_sequences(job);
}

Result<CalibrateCameraReport> calibrate_guided(const CalibrateGuidedJob& job, const CalibrationTarget& target,
                                               const TagFinder& finder, const JobControl& control) {
  if (const std::string note = untried_lenses_note(job.fit); !note.empty()) control.note(note);
  GuidedCalibration guided(job.fit, target, finder, job.guide, job.folder);
  const auto resumed = guided.resume(control);
  if (!resumed) return tl::unexpected(resumed.error());
  if (*resumed > 0) control.note(fmt::format("{}: {} existing views", job.folder, *resumed));
  const auto live = is_only_camera(job.sources);
  if (!live) return tl::unexpected(live.error());
  const Status taken = *live ? from_camera(job, guided, control) : from_files(job, guided, control);
  if (!taken) return tl::unexpected(taken.error());
  control.note(to_text(guided.status()));
  return guided.finish();
}

}  // namespace waymark
