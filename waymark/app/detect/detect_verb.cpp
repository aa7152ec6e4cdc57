#include <algorithm>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/cli/detection_flags.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/detect/detect_cameras.hpp"
#include "waymark/app/detect/detect_images.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark::cli {
namespace {

/// `without_lens`: whether tags were refined without a lens model, which the JSON lines report instead.
ExitCode print_ends(const std::vector<DetectedCamera>& cameras, bool without_lens, Console& console) {
  console.end_progress();
  std::size_t tags = 0;
  for (const DetectedCamera& camera : cameras) tags += camera.end ? camera.end->tags : 0;
  if (without_lens && tags > 0) console.note("note: " + without_lens_note(tags));
  ExitCode code = interrupted() ? ExitCode::Interrupted : ExitCode::Ok;
  for (const DetectedCamera& camera : cameras) {
    if (camera.end)
      console.note(to_text(camera, cameras.size() > 1));
    else
      code = console.failed(camera.end.error(), ExitCode::SomeFailed);
  }
  return code;
}

/// `waymark detect v4l2:…`, which runs until Ctrl-C is pressed. If a camera fails, the exit code is that of
/// the failure.
ExitCode detect_live(DetectCamerasJob job, bool json, bool covariance, const TagFinder& finder,
                     Console& console) {
  job.on_image = [&](const ImageReport& report, const PoseList& poses, Duration age) {
    const double age_ms = 1e3 * to_seconds(age);
    if (json) {
      console.print(json_line(fields(ImageLine{report, poses, covariance, age_ms})));
    } else if (!job.page) {
      console.print(waymark::to_text(report) + waymark::to_text(report.detections, poses));
    } else {
      console.live(fmt::format("{} tags, {:.0f} ms old", report.detections.size(), age_ms));
    }
  };
  JobControl control = control_from(console);
  control.cancelled = [&console] { return interrupted() || console.output_ended(); };
  const auto cameras = detect_cameras(job, finder, control);
  const bool without_lens = !json && !job.poses && finder.refinement;
  if (cameras) return print_ends(*cameras, without_lens, console);
  return fail_by_kind(cameras.error(), console);
}

struct DetectArgs : DetectRequest {
  explicit DetectArgs(CLI::App& verb) : settings(verb), detector(settings, kFirstGroup), poses(verb) {
    add_fields(verb, static_cast<DetectRequest&>(*this));
  }

  Settings settings;
  DetectorFlags detector;
  PoseFlags poses;
};

ExitCode detect(const DetectArgs& args, Console& console) {
  const CLI::App& app = args.settings.app();
  Refusals refused(app);
  refused.fields(!args.json, {"covariance"}, "tables do not show covariances",
                 "Set `json`, or omit `covariance`.");
  if (!refused.status()) return fail_usage(refused.status().error(), console);
  const auto finder = args.detector.make();
  if (!finder) return fail_usage(finder.error(), console);
  auto poses = args.poses.make(families_of(*finder));
  if (!poses) return fail_usage(poses.error(), console);
  if (*poses) console.warn((*poses)->sizes.warnings());
  const auto live = is_camera_input(args.job.sources, given_on(app));
  if (!live) return fail_usage(live.error(), console);
  if (*live)
    return detect_live({.addresses = args.job.sources,
                        .poses = std::move(*poses),
                        .duration_s = args.duration_s,
                        .page = args.view ? std::optional(args.page) : std::nullopt},
                       args.json, args.covariance, *finder, console);
  DetectJob job = args.job;
  job.poses = std::move(*poses);
  std::size_t found_poses = 0;
  std::size_t misfits = 0;
  const auto summary = detect_images(
      job, *finder, control_from(console), [&](const ImageReport& report, const PoseList& of_tags) {
        found_poses += static_cast<std::size_t>(
            std::ranges::count_if(of_tags, [](const auto& pose) { return pose.has_value(); }));
        misfits += count_misfits(of_tags);
        if (args.json)
          console.print(json_line(fields(ImageLine{report, of_tags, args.covariance})));
        else if (report.detected)
          console.print(to_text(report) + to_text(report.detections, of_tags));
        return !console.output_ended();
      });
  if (!summary) return fail_usage(summary.error(), console);
  if (misfits > 0) console.note("note: " + misfit_note(misfits, found_poses));
  if (!args.json && summary->without_lens > 0)
    console.note("note: " + without_lens_note(summary->without_lens));
  console.note(fmt::format("{}, {}, {} failed", counted(summary->images, "image"),
                           counted(summary->tags, "tag"), summary->failed));
  if (job.poses && summary->tags > 0 && summary->failed == 0) console.note(calibration_note(*job.poses));
  if (summary->stopped) return ExitCode::Interrupted;
  return summary->failed > 0 || summary->annotations_failed ? ExitCode::SomeFailed : ExitCode::Ok;
}

}  // namespace

Verb detect_verb() {
  return {
      .name = "detect",
      .sentence = "Detect tags in images, with sub-pixel corners",
      .help =
          R"(Results are written to standard output, messages and progress to standard error. Corners are where the black and the
white border meet, in the order top left, top right, bottom right, bottom left of the printed tag. Pixel (i, j) covers
[i, i+1) x [j, j+1). Images in a folder are processed in order of their names. Images in a recording or a video are
named after file and stamp: lap.mcap#12.345000000. The stamp of a video image is its presentation time since the first
image. The rotation flag of a video is ignored.

Exit code: 0 all inputs processed (with or without tags), 1 some inputs failed (the others are processed),
2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark detect photograph.png
  waymark detect --annotate seen --family tag36h11 --family tag16h5 'photos/*.png'
  waymark detect --json photos/ > tags.jsonl
  waymark detect walk.mp4 --annotate seen.mp4
  waymark detect --camera camera.yaml --tag-size-m 0.16 photograph.png
  waymark detect v4l2:/dev/video0,size=1280x720 --view --camera camera.yaml --tag-size-m 0.16
  waymark detect v4l2:/dev/video0 v4l2:/dev/video2 --json

With --camera and --tag-size-m, corners are refined with the lens model of the camera. The pose of each tag in the
camera frame (x right, y down, z forward) is printed with standard deviations. For a tag viewed almost frontally, two
poses fit almost equally well. Both are printed, the better one first, with the ratio of their errors (ambiguous if near
1). Without --camera, images in a recording are refined with the calibration that the recording contains for them, and
all other images without a lens model.

If the camera file is a calibration.yaml, the standard deviations include the uncertainty of the calibration. A camera
file without standard deviations (ROS camera_info, kalibr, PhotonVision, OpenCV) is taken as exact.
)",
      .prepare = prepared(detect),
      .report = report_of<ImageLine>};
}

}  // namespace waymark::cli
