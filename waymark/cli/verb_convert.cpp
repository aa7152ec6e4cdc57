#include <fmt/format.h>

#include "waymark/cli/convert_video_flags.hpp"
#include "waymark/cli/parts.hpp"
#include "waymark/jobs/convert_log.hpp"
#include "waymark/live/camera_address.hpp"
#include "waymark/media/video_format.hpp"

namespace waymark::cli {
namespace {

struct ConvertArgs : ConvertWords {
  explicit ConvertArgs(CLI::App& app) : video(app) {
    add_fields(app, static_cast<ConvertWords&>(*this));
    add_flag(app, "--json", json, "One JSON object instead of words");
  }

  bool json = false;
  ConvertVideoFlags video;
};

void say_problems(const std::vector<LogProblem>& problems, Console& console) {
  std::vector<std::string> lines;
  for (const LogProblem& problem : problems) {
    const char* kind = problem.kind == LogProblem::Kind::Damage ? "damage" : "note";
    lines.push_back(fmt::format("{}: {}", kind, to_string(problem)));
  }
  console.say_first(lines, "--json gives all");
}

ExitCode convert(const ConvertArgs& args, Console& console) {
  const ConvertJob job = described_convert(args);
  if (job.inputs.size() == 1 && is_camera_address(args.first))
    return args.video.record(args.first, job.output, args.json, console);
  if (job.inputs.size() == 1 && looks_like_video(args.first))
    return args.video.convert(args.first, job.output, args.json, console);
  if (const Status unused = args.video.check_unused(); !unused) return fail_usage(unused.error(), console);
  const Result<ConvertReport> report = convert_log(job, control_from(console));
  if (!report && report.error().code == ErrorCode::InvalidArgument)
    return fail_usage(report.error(), console);
  if (!report) return console.failed(naming_flag(report.error()), exit_code_of(report.error()));
  console.print(args.json ? json_line(to_json(job, *report)) : to_text(job, *report));
  if (!args.json) say_problems(report->exported.problems, console);
  return ExitCode::Ok;
}

}  // namespace

Verb convert_verb() {
  return {
      .name = "convert",
      .sentence = "Write a recording of any format as MCAP, rosbag2, TUM or CSV",
      .help =
          R"(Reads MCAP, rosbag2 (.db3 or a bag folder, split or not), ROS 1 bags, LCM event logs of an MBot and CSV tables, each
also packed with bzip2, gzip or zstd. What a file is, its content tells. Damage and traps (units, orders, stamps) are
handled and said (docs/formats/importing.md). OUT appears only when it is whole.

  .mcap   ROS 2 messages pass as they are; those of ROS 1 are rewritten; LCM and CSV become our messages
  .tum    poses of one topic: timestamp [s] tx ty tz [m] qx qy qz qw
  .csv    detections, odometry, imu or range-bearing, units in the names of the columns
  folder  of a bag for `ros2 bag play`, with --format rosbag2

Of a video (mp4, mkv, webm, avi) or a live camera (v4l2:/dev/video0) the tags of every picture are found and written to .mcap, with
times since its first picture or since 1970; with --camera and --tag-size-m also the calibration and the size, with --pictures the pictures.

Exit code: 0 written, 1 not readable or not writable, 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark convert lap.mcap path.tum --topics /odom
  waymark convert lap.mcap seen.csv --kind detections --from 2 --to 10
  waymark convert lap.mcap lap_bag --format rosbag2 --ros-distro humble
  waymark convert walk.mp4 walk.mcap --camera calibration.yaml --tag-size-m 0.165 --pictures jpeg
  waymark convert v4l2:/dev/video0 desk.mcap --duration-s 10 --pictures jpeg
  waymark convert detections.csv odometry.csv imu.csv lap.mcap --robot limo
)",
      .prepare = prepared(convert)};
}

}  // namespace waymark::cli
