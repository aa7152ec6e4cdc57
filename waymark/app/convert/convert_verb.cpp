#include <string>
#include <utility>

#include <fmt/format.h>
#include <CLI/App.hpp>

#include "waymark/app/cli/detection_flags.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/convert/convert_log.hpp"
#include "waymark/app/convert/record_camera.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/media/video_format.hpp"

namespace waymark::cli {
namespace {

/// Flags of `waymark convert` for videos and live cameras: camera, tag size, detector, --record-images and
/// --duration-s. Must not be moved in memory, because the command line is parsed into its members.
class ConvertVideoFlags {
 public:
  explicit ConvertVideoFlags(CLI::App& verb);

  /// Fails if one of these flags is given. Call this if the input is a recording.
  [[nodiscard]] Status check_unused() const;
  /// Writes the tags detected in a video to a recording and prints the result.
  [[nodiscard]] ExitCode convert(const std::string& input, const std::string& output, bool json,
                                 Console& console) const;
  /// Writes the tags detected by a live camera to a recording until --duration-s has elapsed or Ctrl-C is
  /// pressed.
  [[nodiscard]] ExitCode record(const std::string& address, const std::string& output, bool json,
                                Console& console) const;

 private:
  /// A job and a detector, created from the flags.
  struct Prepared {
    ConvertVideoJob job{};
    TagFinder finder{};
  };
  [[nodiscard]] Result<Prepared> prepare(const std::string& input, const std::string& output) const;

  const CLI::App& app_;
  Settings settings_;
  PoseFlags poses_;
  DetectorFlags detector_;
  std::string images_;
  double duration_s_ = 0;
};

ConvertVideoFlags::ConvertVideoFlags(CLI::App& verb)
    : app_(verb), settings_(verb), poses_(verb), detector_(settings_, kMoreGroup) {
  add_option(verb, "--record-images NAME", images_,
             "Also record the images of a video or a live camera, as jpeg or raw", one_of({"jpeg", "raw"}));
  add_option(verb, "--duration-s FLOAT", duration_s_, "Recording time of a live camera; 0: until Ctrl-C",
             between(0.0, 1e7));
}

Status ConvertVideoFlags::check_unused() const {
  const char* why = "cameras, tag sizes, detectors and --record-images have no effect on recordings";
  const char* hint = "Omit this option, or give one video.";
  Refusals refused(app_);
  refused.fields(true, {"--record-images"}, why, hint);
  refused.fields(true, {"--duration-s"}, "this option applies to live cameras", "Omit this option.");
  refused.all(true, poses_, why, hint);
  refused.all(true, detector_, why, hint);
  return refused.status();
}

Result<ConvertVideoFlags::Prepared> ConvertVideoFlags::prepare(const std::string& input,
                                                               const std::string& output) const {
  if (const Status used = check_no_recording(given_on(app_)); !used) return tl::unexpected(used.error());
  auto finder = detector_.make();
  if (!finder) return tl::unexpected(finder.error());
  const auto poses = poses_.make(families_of(*finder));
  if (!poses) return tl::unexpected(poses.error());
  Prepared prepared{{.input = input, .output = output, .images = images_}, std::move(*finder)};
  if (*poses) {
    prepared.job.camera = (*poses)->camera;
    prepared.job.sizes = (*poses)->sizes;
  }
  return prepared;
}

ExitCode ConvertVideoFlags::convert(const std::string& input, const std::string& output, bool json,
                                    Console& console) const {
  Refusals refused(app_);
  refused.fields(true, {"--duration-s"}, "this option applies to live cameras", "Omit this option.");
  const auto prepared = refused.status() ? prepare(input, output) : tl::unexpected(refused.status().error());
  if (!prepared) return fail_with(prepared.error(), console);
  const Result<VideoTags> found = convert_video(prepared->job, prepared->finder, control_from(console));
  if (!found) return fail_by_kind(found.error(), console);
  for (const VideoProblem& problem : found->problems)
    console.note(fmt::format("note: {}{}", to_string(problem.error),
                             problem.count > 1 ? fmt::format(" ({} times)", problem.count) : ""));
  console.print(json ? json_line(fields(ConvertedVideo{input, output, *found}))
                     : to_text(prepared->job, *found));
  return ExitCode::Ok;
}

ExitCode ConvertVideoFlags::record(const std::string& address, const std::string& output, bool json,
                                   Console& console) const {
  const auto prepared = prepare(address, output);
  if (!prepared) return fail_with(prepared.error(), console);
  const auto report = record_camera(prepared->job, duration_s_, prepared->finder, control_from(console));
  if (!report) return fail_by_kind(report.error(), console);
  console.print(json ? json_line(fields(*report)) : to_text(*report));
  return report->end.stopped ? ExitCode::Interrupted : ExitCode::Ok;
}

struct ConvertArgs : ConvertRequest {
  explicit ConvertArgs(CLI::App& app) : video(app) {
    add_fields(app, static_cast<ConvertRequest&>(*this));
    add_flag(app, "--json", json, "One JSON object instead of text");
  }

  bool json = false;
  ConvertVideoFlags video;
};

void print_problems(const std::vector<LogProblem>& problems, Console& console) {
  std::vector<std::string> lines;
  for (const LogProblem& problem : problems) {
    const char* kind = problem.kind == LogProblem::Kind::Damage ? "damage" : "note";
    lines.push_back(fmt::format("{}: {}", kind, to_string(problem)));
  }
  console.note_first(lines, "--json gives all");
}

ExitCode convert(const ConvertArgs& args, Console& console) {
  const ConvertJob job = described_convert(args);
  if (job.inputs.size() == 1 && is_camera_address(args.first))
    return args.video.record(args.first, job.output, args.json, console);
  if (job.inputs.size() == 1 && kind_of(args.first) == FileKind::Video)
    return args.video.convert(args.first, job.output, args.json, console);
  if (const Status unused = args.video.check_unused(); !unused) return fail_usage(unused.error(), console);
  const Result<ConvertReport> report = convert_log(job, control_from(console));
  if (!report) return fail_by_kind(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report));
  if (!args.json) print_problems(report->exported.problems, console);
  return ExitCode::Ok;
}

}  // namespace

Verb convert_verb() {
  return {
      .name = "convert",
      .sentence = "Convert a recording in any format to MCAP, rosbag2, TUM or CSV",
      .help =
          R"(Reads MCAP, rosbag2 (.db3 or a bag folder, split or not), ROS 1 bags, LCM event logs from an MBot, and CSV tables. Files
may be compressed with bzip2, gzip or zstd. The format is detected from the content. Damage and traps (units, order of
values, stamps) are handled and reported (docs/formats/importing.md). OUT is written completely or not at all.

  .mcap   ROS 2 messages are copied; ROS 1 messages are rewritten; LCM and CSV become Waymark's messages
  .tum    poses of one topic: timestamp [s] tx ty tz [m] qx qy qz qw
  .csv    detections, odometry, imu or range-bearing, with units in the column names
  folder  a bag for `ros2 bag play`, with --format rosbag2

For a video (mp4, mkv, webm, avi) or a live camera (v4l2:/dev/video0), the tags in every image are detected and written
to .mcap. Stamps are times since the first image for a video, and since 1970 for a camera. With --camera and
--tag-size-m, calibration and tag size are recorded as well; with --record-images, also the images.

Exit code: 0 written, 1 a file could not be read or written, 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark convert lap.mcap path.tum --topics /odom
  waymark convert lap.mcap seen.csv --kind detections --from 2 --to 10
  waymark convert lap.mcap lap_bag --format rosbag2 --ros-distro humble
  waymark convert walk.mp4 walk.mcap --camera calibration.yaml --tag-size-m 0.165 --record-images jpeg
  waymark convert v4l2:/dev/video0 desk.mcap --duration-s 10 --record-images jpeg
  waymark convert detections.csv odometry.csv imu.csv lap.mcap --robot limo
)",
      .prepare = prepared(convert),
      .report = report_of_any<ConvertReport, ConvertedVideo, RecordCameraReport>};
}

}  // namespace waymark::cli
