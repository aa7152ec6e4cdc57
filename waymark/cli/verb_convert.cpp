#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/convert_video_flags.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/flags.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/convert_log.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/live/camera_address.hpp"
#include "waymark/media/video_format.hpp"

namespace waymark::cli {
namespace {

struct ConvertArgs {
  explicit ConvertArgs(CLI::App& app) : video(app) {}

  std::string first;
  std::vector<std::string> rest;  ///< further inputs, then the output
  ConvertJob job{};
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
  if (args.job.inputs.size() == 1 && is_camera_address(args.first))
    return args.video.record(args.first, args.job.output, args.json, console);
  if (args.job.inputs.size() == 1 && looks_like_video(args.first))
    return args.video.convert(args.first, args.job.output, args.json, console);
  if (const Status unused = args.video.check_unused(); !unused) return fail_usage(unused.error(), console);
  const Result<ConvertReport> report = convert_log(args.job, control_from(console));
  if (!report) {
    console.say(naming_flag(report.error()));
    if (interrupted()) return ExitCode::Interrupted;
    return report.error().code == ErrorCode::InvalidArgument ? ExitCode::Usage : exit_code_of(report.error());
  }
  if (args.json) {
    console.print(json_line(to_json(args.job, *report)));
    return ExitCode::Ok;
  }
  console.print(to_text(args.job, *report));
  say_problems(report->exported.problems, console);
  return ExitCode::Ok;
}

Run prepare_convert(CLI::App& app) {
  const auto args = std::make_shared<ConvertArgs>(app);
  add_option(
      app, "IN", args->first,
      "Recording: MCAP, rosbag2 (.db3, folder), ROS 1 bag, LCM event log, CSV; a video; or a live camera",
      kRequired);
  add_option(app, "OUT", args->rest,
             "New file: .mcap, .tum or .csv; new folder for --format rosbag2. Before it further recordings "
             "of the same drive, which are merged in the order of their stamps",
             kRequired);
  add_option(app, "--format NAME", args->job.format,
             "Format of the output: mcap, rosbag2, tum or csv. Unless given: by the ending of OUT");
  add_option(app, "--ros-distro NAME", args->job.ros_distro,
             "Release of ROS 2 whose layout --format rosbag2 writes: humble or jazzy (jazzy)");
  add_option(app, "--storage NAME", args->job.storage,
             "Storage of --format rosbag2: sqlite3 (usual in Humble) or mcap (usual in Jazzy)");
  add_option(app, "--topics,--topic A,B", args->job.topics, "Only these topics, with commas between them",
             kByCommas);
  add_option(app, "--from T", args->job.from,
             "Begin of the interval [s]: after the start, or with @ on the recording's clock");
  add_option(app, "--to T", args->job.to,
             "End of the interval [s]: after the start, or with @ on the recording's clock");
  add_option(app, "--kind NAME", args->job.kind,
             "Content of a .csv file: detections, odometry, imu or range-bearing",
             one_of({"detections", "odometry", "imu", "range-bearing"}));
  add_option(app, "--robot FILE", args->job.robot,
             "Camera and its mounting for tables and LCM logs that become .mcap: a robot's file, or a name");
  add_option(app, "--tag-latency-s S", args->job.tag_latency_s,
             "Camera latency of an MBot: time from the exposure to the stamp of a picture [s] (LCM logs)",
             between(0.0, 10.0), kShown);
  add_flag(app, "--json", args->json, "One JSON object instead of words");
  return [args](Console& console) {
    args->job.inputs = {args->first};
    args->job.inputs.insert(args->job.inputs.end(), args->rest.begin(), args->rest.end() - 1);
    args->job.output = args->rest.back();
    return convert(*args, console);
  };
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
      .prepare = prepare_convert,
      .verbs = {}};
}

}  // namespace waymark::cli
