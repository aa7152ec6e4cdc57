#include "waymark/cli/map_video_flags.hpp"

#include "waymark/cli/job_flags.hpp"
#include "waymark/cli/map_flags.hpp"
#include "waymark/jobs/camera_tags.hpp"

namespace waymark::cli {
namespace {

/// Flags that have no effect on videos: about robots, their odometry and their routes, and about what was not
/// given.
Status check_effects(const MapArgs& args, const MapVideoDescription& of) {
  const char* not_of_videos = "this has no effect on videos";
  const char* hint = "A video is mapped without a robot and its odometry: leave it out.";
  Refusals refused(args.settings.app());
  refused.flags(true,
                {"--robot", "--method", "--world", "--extend", "--route-name", "--freeze", "--remove",
                 "--model", "--map-sigma", "--against", "--tagslam", "--base-frame", "--camera-frame",
                 "--camera-topic", "--imu-topic", "--odometry-topic"},
                not_of_videos, hint);
  args.refuse_lap_options(refused, not_of_videos, hint);
  refused.flags(args.of.prior.empty(), {"--prior-sigma-m", "--prior-sigma-deg"}, "this is about an older map",
                "Give it with --prior.");
  refused.flags(of.upright.empty() && of.floor.empty() && of.planes.empty(), {"--level-sigma-deg"},
                "no tag is said to be level", "Give it with --upright, --floor or --plane.");
  refused.flags(args.of.anchor.find(',') != std::string::npos || of.prior_sigma_m || of.prior_sigma_deg,
                {"--anchor-pose"}, "the tags of --prior hold this map",
                "Leave it out, or give one --anchor and neither --prior-sigma-m nor --prior-sigma-deg.");
  return refused.status();
}

}  // namespace

MapVideoFlags::MapVideoFlags(CLI::App& app) : app_(app) { add_fields(app, of_); }

bool MapVideoFlags::takes(const MapArgs& args) const {
  return is_of_camera(args.job.lap, app_.count("--camera") > 0);
}

Status MapVideoFlags::check_unused() const {
  Refusals refused(app_);
  refused.flags(true, {"--camera", "--camera-name", "--camera-size"}, "a recording brings its camera along",
                "Give --robot for a recording without a calibration; --camera is that of a video.");
  refused.flags(true,
                {"--readout-ms", "--tag-size-sigma-m", "--distance", "--upright", "--floor", "--plane",
                 "--level-sigma-deg", "--prior-sigma-m", "--prior-sigma-deg"},
                "this is about videos", "Leave it out.");
  return refused.status();
}

Result<MapVideoJob> MapVideoFlags::job_of(const MapArgs& args) const {
  if (Status sound = check_effects(args, of_); !sound) return tl::unexpected(sound.error());
  const Result<MapJob> common = args.make_job();
  if (!common) return tl::unexpected(common.error());
  MapVideoDescription of = of_;
  of.anchor = args.of.anchor;
  of.prior = args.of.prior;
  Result<MapVideoJob> job = described_map_video(of, common->overrides.tag_size_m);
  if (!job) return job;
  for (const auto& [tag, size_m] : common->overrides.size_by_tag_m) job->sizes.size_by_tag_m[tag] = size_m;
  job->folder = common->folder;
  job->videos = {common->lap};
  job->videos.insert(job->videos.end(), common->more.begin(), common->more.end());
  job->map_T_anchor = common->overrides.map_T_anchor;
  job->search = common->options.bundle.search;
  return job;
}

ExitCode MapVideoFlags::map(const MapArgs& args, Console& console) const {
  const Result<MapVideoJob> job = job_of(args);
  if (!job) return fail_with(job.error(), console);
  const Result<TagFinder> finder = args.detector.make();
  if (!finder) return fail_usage(finder.error(), console);
  const Result<MapVideoReport> report = map_video(*job, *finder, control_from(console));
  if (!report) return console.failed(naming_flag(report.error()), ExitCode::SomeFailed);
  return args.show(*report, console);
}

}  // namespace waymark::cli
