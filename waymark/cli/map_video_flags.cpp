#include "waymark/cli/map_video_flags.hpp"

#include "waymark/cli/job_flags.hpp"
#include "waymark/cli/map_flags.hpp"
#include "waymark/jobs/camera_tags.hpp"

namespace waymark::cli {
MapVideoFlags::MapVideoFlags(CLI::App& app) : app_(app) { add_fields(app, of_); }

bool MapVideoFlags::takes(const MapArgs& args) const {
  return is_of_camera(args.job.lap, app_.count("--camera") > 0);
}

Result<MapVideoJob> MapVideoFlags::job_of(const MapArgs& args) const {
  MapVideoDescription of = of_;
  of.anchor = args.of.anchor;
  of.prior = args.of.prior;
  Refusals refused(app_);
  args.refuse_lap_options(refused, kNotOfVideos, kNoRobot);
  Status sound = check_effects(of, given_on(app_));
  if (sound) sound = refused.status();
  if (!sound) return tl::unexpected(sound.error());
  const Result<MapJob> common = args.make_job();
  if (!common) return tl::unexpected(common.error());
  return described_map_video(of, *common);
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
