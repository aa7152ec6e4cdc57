#include "waymark/cli/map_video_flags.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/base/angles.hpp"
#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/map_flags.hpp"
#include "waymark/cli/warnings.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/config/landmarks_file.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/map_text.hpp"
#include "waymark/media/video_format.hpp"

namespace waymark::cli {
namespace {

/// Options that are about robots, their odometry and their routes.
Status check_video_flags(const MapArgs& args) {
  constexpr std::array kNot = {"--robot",        "--method",       "--world",     "--extend",
                               "--route-name",   "--freeze",       "--remove",    "--model",
                               "--map-sigma",    "--against",      "--tagslam",   "--base-frame",
                               "--camera-frame", "--camera-topic", "--imu-topic", "--odometry-topic"};
  const char* why = "this has no effect on videos";
  const char* hint = "A video is mapped without a robot and its odometry: leave it out.";
  for (const char* name : kNot) {
    if (Status status = refuse_flag(args.app, name, why, hint); !status) return status;
  }
  return args.refuse_lap_options(why, hint);
}

}  // namespace

MapVideoFlags::MapVideoFlags(CLI::App& app) {
  app.add_option(
         "--camera", camera_,
         "Calibration of the camera of a video (calibration.yaml, ROS camera_info, kalibr YAML or JSON "
         "of PhotonVision)")
      ->type_name("FILE")
      ->group("Videos");
  app.add_option("--camera-name", camera_name_, "Name of the camera of a video, when the file holds several")
      ->type_name("NAME")
      ->group("Videos");
}

bool MapVideoFlags::takes(const MapArgs& args) { return looks_like_video(args.lap); }

Status MapVideoFlags::check_unused() const {
  if (camera_.empty() && camera_name_.empty()) return {};
  return fail(ErrorCode::InvalidArgument, "a recording brings its camera along",
              {.key = camera_.empty() ? "--camera-name" : "--camera"},
              "Give --robot for a recording without a calibration; --camera is that of a video.");
}

Result<MapVideoJob> MapVideoFlags::job_of(const MapArgs& args) const {
  if (Status sound = check_video_flags(args); !sound) return tl::unexpected(sound.error());
  if (camera_.empty())
    return fail(ErrorCode::InvalidArgument, "a video says nothing about its camera", {.key = "--camera"},
                "Give its calibration: --camera calibration.yaml. `waymark calibrate camera` makes one.");
  if (!args.tag_size_m)
    return fail(ErrorCode::InvalidArgument, "a video does not say how large its tags are",
                {.key = "--tag-size-m"},
                "Measure the side of the black square, for example --tag-size-m 0.165.");
  const Result<MapJob> common = args.make_job();
  if (!common) return tl::unexpected(common.error());
  Result<NamedCamera> camera = read_camera(camera_, camera_name_);
  if (!camera) return tl::unexpected(camera.error());
  MapVideoJob job{.videos = {args.lap}, .camera = std::move(camera->camera), .folder = args.folder};
  job.videos.insert(job.videos.end(), args.more.begin(), args.more.end());
  job.sizes.default_size_m = args.tag_size_m;
  job.map_T_anchor = common->overrides.map_T_anchor;
  job.search = common->options.bundle.search;
  if (common->overrides.anchor) {
    const Result<TagId> anchor = tag_named(*common->overrides.anchor);
    if (!anchor) return tl::unexpected(anchor.error());
    job.anchor = *anchor;
  }
  if (args.prior.empty()) return job;
  Result<LandmarksFile> prior = read_landmarks(args.prior, args.tag_size_m);
  if (!prior) return tl::unexpected(prior.error());
  job.prior = std::move(prior->tags);
  return job;
}

ExitCode MapVideoFlags::map(const MapArgs& args, Console& console) const {
  const Result<MapVideoJob> job = job_of(args);
  if (!job) return fail_with(job.error(), console);
  const Result<TagFinder> finder = args.detector.make();
  if (!finder) return fail_usage(finder.error(), console);
  const Result<MapVideoReport> report = map_video(*job, *finder, control_from(console));
  if (!report)
    return console.failed(naming_flag(report.error()),
                          interrupted() ? ExitCode::Interrupted : ExitCode::SomeFailed);
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report, args.folder));
  say_warnings(report->warnings, console);
  return ExitCode::Ok;
}

}  // namespace waymark::cli
