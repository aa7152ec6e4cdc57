#include "waymark/cli/map_video_flags.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/base/angles.hpp"
#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/map_flags.hpp"
#include "waymark/cli/warnings.hpp"
#include "waymark/config/calibration_file.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/config/landmarks_file.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/lap_input.hpp"
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

std::vector<std::string> split_at_commas(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    if (end > begin) parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::optional<double> number_in(const std::string& text) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, problem] = std::from_chars(text.data(), end, value);
  return problem == std::errc() && stop == end ? std::optional(value) : std::nullopt;
}

/// "3,7" or "tag36h11:3": tags in one text or several.
Result<std::vector<TagId>> tags_named(const std::vector<std::string>& texts, const char* flag) {
  std::vector<TagId> tags;
  for (const std::string& text : texts) {
    for (const std::string& name : split_at_commas(text)) {
      Result<TagId> tag = tag_named(name);
      if (!tag) {
        tag.error().place.key = flag;
        return tl::unexpected(tag.error());
      }
      tags.push_back(*tag);
    }
  }
  return tags;
}

/// "3,7,2.41" or "3,7,2.41,0.002".
Result<MeasuredDistance> distance_named(const std::string& text) {
  const std::vector<std::string> parts = split_at_commas(text);
  const auto wrong = [&] {
    return fail(ErrorCode::InvalidArgument, fmt::format("'{}' is no distance between two tags", text),
                {.key = "--distance"},
                "Two ids and metres: 3,7,2.41, with a standard deviation 3,7,2.41,0.002.");
  };
  if (parts.size() != 3 && parts.size() != 4) return wrong();
  const Result<TagId> a = tag_named(parts[0]);
  const Result<TagId> b = tag_named(parts[1]);
  MeasuredDistance distance;
  if (!a || !b || *a == *b) return wrong();
  distance.a = *a;
  distance.b = *b;
  const auto length = number_in(parts[2]);
  const auto sigma = parts.size() == 4 ? number_in(parts[3]) : std::optional(distance.sigma_m);
  if (!length || !sigma || !(*length > 0 && *length < 1e4) || !(*sigma > 0 && *sigma < 1e3)) return wrong();
  distance.measured_m = *length;
  distance.sigma_m = *sigma;
  return distance;
}

}  // namespace

MapVideoFlags::MapVideoFlags(CLI::App& app) : app_(app) {
  constexpr const char* kGroup = "Videos";
  app.add_option(
         "--camera", camera_,
         "Calibration of the camera of a video (calibration.yaml, ROS camera_info, kalibr YAML or JSON "
         "of PhotonVision); the standard deviations of a calibration.yaml become part of the map's")
      ->type_name("FILE")
      ->group(kGroup);
  app.add_option("--camera-name", camera_name_, "Name of the camera of a video, when the file holds several")
      ->type_name("NAME")
      ->group(kGroup);
  app.add_option(
         "--readout-ms", readout_ms_,
         "Time from the first row to the last of the camera's rolling shutter, in milliseconds; negative "
         "when rows are read from the bottom. Unless given: that of a calibration.yaml, else 0")
      ->check(CLI::Range(-200.0, 200.0))
      ->type_name("NUMBER")
      ->group(kGroup);
  app.add_option(
         "--tag-size-sigma-m", tag_size_sigma_m_,
         "Standard deviation of --tag-size-m, the same error for all tags of a video [m]; it becomes part "
         "of the map's covariance")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0))
      ->type_name("NUMBER")
      ->group(kMoreGroup);
  app.add_option(
         "--distance", distances_,
         "A measured distance between the centres of two tags of a video, which gives the scale: ids, "
         "metres and, unless it is 0.005 m, its standard deviation, such as 3,7,2.41 or 3,7,2.41,0.002. "
         "May be repeated")
      ->type_name("TAG,TAG,METRES")
      ->group(kGroup);
  app.add_option("--upright", upright_,
                 "Tags of a video that hang upright on vertical walls, such as 3,7: they level the map")
      ->delimiter(',')
      ->type_name("TAGS")
      ->group(kGroup);
  app.add_option("--floor", floor_,
                 "Tags of a video that lie on the floor: they level the map, and z is 0 there")
      ->delimiter(',')
      ->type_name("TAGS")
      ->group(kGroup);
  app.add_option(
         "--plane", planes_,
         "Tags of a video that are on one plane, such as one wall, wherever it is: 3,4,7. May be repeated")
      ->type_name("TAGS")
      ->group(kGroup);
  app.add_option(
         "--level-sigma-deg", level_sigma_deg_,
         "Standard deviation of the directions of the tags of --upright, --floor and --plane, in degrees")
      ->capture_default_str()
      ->check(CLI::Range(1e-3, 45.0))
      ->type_name("NUMBER")
      ->group(kMoreGroup);
  app.add_option("--prior-sigma-m", prior_sigma_m_,
                 "Standard deviation of the places of --prior, for a video: its tags then hold the map, each "
                 "within it [m]")
      ->check(CLI::Range(1e-6, 10.0))
      ->type_name("NUMBER")
      ->group(kMoreGroup);
  app.add_option("--prior-sigma-deg", prior_sigma_deg_,
                 "The same of their directions, in degrees. Unless given, with --prior-sigma-m: 2")
      ->check(CLI::Range(1e-4, 180.0))
      ->type_name("NUMBER")
      ->group(kMoreGroup);
}

bool MapVideoFlags::takes(const MapArgs& args) { return looks_like_video(args.lap); }

Status MapVideoFlags::check_unused() const {
  for (const char* name : {"--camera", "--camera-name"}) {
    if (Status status =
            refuse_flag(app_, name, "a recording brings its camera along",
                        "Give --robot for a recording without a calibration; --camera is that of a "
                        "video.");
        !status)
      return status;
  }
  for (const char* name : {"--readout-ms", "--tag-size-sigma-m", "--distance", "--upright", "--floor",
                           "--plane", "--level-sigma-deg", "--prior-sigma-m", "--prior-sigma-deg"}) {
    if (Status status = refuse_flag(app_, name, "this is about videos", "Leave it out."); !status)
      return status;
  }
  return {};
}

Result<MapVideoJob> MapVideoFlags::read_camera_of_job() const {
  Result<NamedCamera> camera = read_camera(camera_, camera_name_);
  if (!camera) return tl::unexpected(camera.error());
  MapVideoJob job{.camera = camera->camera};
  if (const Result<Calibration> ours = read_calibration(camera_)) {
    job.intrinsics_sigma = intrinsics_sigma(job.camera, *ours);
    job.readout_s = ours->known("readout_s").value_or(0);
  }
  if (readout_ms_) job.readout_s = *readout_ms_ * 1e-3;
  return job;
}

Status MapVideoFlags::read_place(const MapArgs& args, MapVideoJob& job) const {
  const auto take = [](const Result<std::vector<TagId>>& tags, std::vector<TagId>& to) -> Status {
    if (!tags) return tl::unexpected(tags.error());
    to = *tags;
    return {};
  };
  if (Status s = take(tags_named({args.anchor}, "--anchor"), job.anchors); !s) return s;
  if (Status s = take(tags_named(upright_, "--upright"), job.upright); !s) return s;
  if (Status s = take(tags_named(floor_, "--floor"), job.floor); !s) return s;
  for (const std::string& plane : planes_)
    if (Status s = take(tags_named({plane}, "--plane"), job.planes.emplace_back()); !s) return s;
  for (const std::string& text : distances_) {
    const Result<MeasuredDistance> distance = distance_named(text);
    if (!distance) return tl::unexpected(distance.error());
    job.distances.push_back(*distance);
  }
  job.level_sigma_rad = to_radians(level_sigma_deg_);
  job.prior_sigma_m = prior_sigma_m_;
  if (prior_sigma_deg_ || prior_sigma_m_) job.prior_sigma_rad = to_radians(prior_sigma_deg_.value_or(2));
  if (args.prior.empty()) {
    if (Status s =
            refuse_flag(app_, "--prior-sigma-m", "this is about an older map", "Give it with --prior.");
        !s)
      return s;
    return refuse_flag(app_, "--prior-sigma-deg", "this is about an older map", "Give it with --prior.");
  }
  Result<LandmarksFile> prior = read_landmarks(args.prior, args.tag_size_m);
  if (!prior) return tl::unexpected(prior.error());
  job.prior = std::move(prior->tags);
  return {};
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
  Result<MapVideoJob> job = read_camera_of_job();
  if (!job) return job;
  job->folder = args.folder;
  job->videos = {args.lap};
  job->videos.insert(job->videos.end(), args.more.begin(), args.more.end());
  job->sizes.default_size_m = args.tag_size_m;
  job->size_sigma = tag_size_sigma_m_ / *args.tag_size_m;
  job->map_T_anchor = common->overrides.map_T_anchor;
  job->search = common->options.bundle.search;
  if (Status sound = read_place(args, *job); !sound) return tl::unexpected(sound.error());
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
