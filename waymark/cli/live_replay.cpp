#include "waymark/cli/live_replay.hpp"

#include <string>
#include <utility>

#include "waymark/cli/fresh_file.hpp"
#include "waymark/cli/live_robot.hpp"
#include "waymark/cli/live_story.hpp"

namespace waymark::cli {
namespace {

/// The stage with the tags of the map, where its world is not known: for the recording and the judge.
Stage as_known(const Stage& stage, const MapFile& map) {
  Stage known = stage;
  if (known.world_yaml.empty()) {
    known.simulated.world.anchor = map.anchor;
    known.simulated.world.tags = map.tags;
  }
  return known;
}

}  // namespace

Result<std::unique_ptr<LiveReplay>> LiveReplay::make(const Stage& stage, const ReplayJob& job,
                                                     const ReplayFiles& files, Console& console,
                                                     std::function<void(const ReplayStep&)> on_step) {
  std::unique_ptr<LiveReplay> live(new LiveReplay(as_known(stage, files.map), files));
  auto replayer = make_replayer(files, stage.simulated.model, stage.simulated.camera, with_lidar(job, stage));
  if (!replayer) return tl::unexpected(replayer.error());
  auto recorder = record_replay(live->known_, job);
  if (!recorder) return tl::unexpected(recorder.error());
  live->replayer_ = std::move(*replayer);
  live->log_ =
      std::make_unique<ReplayLog>(std::move(*recorder), job.images, goal_m(files.route, job), console);
  ReplayListener listener = live->log_->listener();
  listener.on_step = [log = live->log_.get(), shown = std::move(on_step)](SensorTime now,
                                                                          const ReplayStep& step) {
    shown(step);
    return log->on_step(now, step);
  };
  live->session_ = std::make_unique<ReplaySession>(*live->replayer_, std::move(listener));
  return live;
}

Result<ReplayReport> LiveReplay::finish(const ReplayEnd& end) {
  if (Status closed = log_->close(); !closed) return tl::unexpected(closed.error());
  ReplayReport report{.end = end,
                      .route_length_m = files_.route.length_m,
                      .true_path = std::move(log_->true_path()),
                      .taught_path = files_.taught,
                      .visits = log_->visits(),
                      .warnings = replayer_->problems()};
  if (report.true_path.empty())
    report.warnings.emplace_back("nobody knows where the robot truly was: not judged");
  else
    judge(known_, report);
  return report;
}

Result<ReplayReport> replay_live(const Stage& stage, const ReplayJob& job, Console& console) {
  const Stopwatch watch;
  const Result<ReplayFiles> files = load_replay(job);
  if (!files) return tl::unexpected(files.error());
  PhaseViewers viewers(job.feed, stage.simulated, OperatorState::Replaying);
  const auto replay =
      LiveReplay::make(stage, job, *files, console, viewers.viewers().watch(goal_m(files->route, job)));
  if (!replay) return tl::unexpected(replay.error());
  FreshFile fresh(job.output);
  const auto robot = LiveRobot::open(stage.process, stage.simulated.camera, console);
  if (!robot) return tl::unexpected(robot.error());
  viewers.viewers().show_map(job.folder);
  ReplaySession& session = (*replay)->session();
  RobotListener listener;
  listener.on_sample = [&](const Sample& sample) {
    fresh.hear(sample);
    return session.hear(sample);
  };
  std::string stopped_by;
  listener.decide = [&](Duration uptime, SensorTime now) -> Result<DriverDecision> {
    const PhaseViewers::Wish wish = viewers.hear(uptime);
    if (wish.over) stopped_by = wish.stop_key ? "stopped with the space bar" : "stopped on the page";
    if (wish.over) return DriverDecision{.done = true};
    if (wish.pause) *wish.pause ? session.pause() : session.resume();
    return session.decide(uptime, now);
  };
  const auto driven = (*robot)->drive(watched(listener, job.feed));
  ReplayEnd end = driven ? session.end(*driven) : session.end();
  if (!stopped_by.empty()) end.reason = stopped_by;
  Result<ReplayReport> report = (*replay)->finish(end);
  if (!driven) return tl::unexpected(driven.error());
  if (!report) return report;
  for (std::string& words : speed_warnings(job, files->route)) report->warnings.push_back(std::move(words));
  report->wall_s = watch.seconds();
  return report;
}

}  // namespace waymark::cli
