#include "waymark/app/replay/live_replay.hpp"

#include <string>
#include <utility>

#include "waymark/app/common/output_files.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/session_viewers.hpp"

namespace waymark {
namespace {

/// The setup with the tags of the map, where its world is not known: for the recording and the judge.
RobotSetup as_known(const RobotSetup& setup, const MapFile& map) {
  RobotSetup known = setup;
  for (const auto& [tag, mapped] : map.tags.tags) known.known_tags.push_back(tag);
  if (known.world_yaml.empty()) {
    known.simulated.world.anchor = map.anchor;
    known.simulated.world.tags = map.tags;
  }
  return known;
}

}  // namespace

Result<std::unique_ptr<LiveReplay>> LiveReplay::make(const RobotSetup& setup, const ReplayJob& job,
                                                     const ReplayFiles& files, const JobControl& control,
                                                     std::function<void(const ReplayStep&)> on_step,
                                                     SessionRequests requests) {
  std::unique_ptr<LiveReplay> live(new LiveReplay(as_known(setup, files.map), files));
  auto replayer = make_replayer(files, setup.robot(), replayer_setup(job));
  if (!replayer) return tl::unexpected(replayer.error());
  auto recorder = record_replay(live->known_, job);
  if (!recorder) return tl::unexpected(recorder.error());
  live->replayer_ = std::move(*replayer);
  live->log_ =
      std::make_unique<ReplayLog>(std::move(*recorder), job.images, goal_m(files.route, job), control);
  ReplayListener listener = live->log_->listener();
  listener.on_step = [log = live->log_.get(), shown = std::move(on_step)](SensorTime now,
                                                                          const ReplayStep& step) {
    shown(step);
    return log->on_step(now, step);
  };
  listener.on_words = control.note;
  live->session_ = std::make_unique<ReplaySession>(*live->replayer_, std::move(listener),
                                                   ReplaySessionOptions{}, std::move(requests));
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
    report.warnings.emplace_back("there is no ground truth of the replay: not judged");
  else
    judge(known_, report);
  return report;
}

Result<ReplayReport> replay_process(const RobotSetup& setup, const ReplayJob& job,
                                    const JobControl& control) {
  const Stopwatch watch;
  const Result<ReplayFiles> files = load_replay(job, control);
  if (!files) return tl::unexpected(files.error());
  if (Status laps = check_drive(job, files->route); !laps) return tl::unexpected(laps.error());
  PhaseViewers viewers(job.feed, setup.simulated, OperatorState::Replaying);
  const auto robot = LiveRobot::open(as_known(setup, files->map), control);
  if (!robot) return tl::unexpected(robot.error());
  const auto replay =
      LiveReplay::make(setup, slowed(job, (*robot)->speed_limit_m_s()), *files, control,
                       viewers.viewers().watch(goal_m(files->route, job)), viewers.requests());
  if (!replay) return tl::unexpected(replay.error());
  FreshFile fresh(job.output);
  viewers.viewers().show_map(job.folder);
  ReplaySession& session = (*replay)->session();
  RobotListener listener = session.listener();
  listener.on_sample = [&](const Sample& sample) {
    fresh.receive(sample);
    return session.receive(sample);
  };
  const auto driven = (*robot)->drive(watched(std::move(listener), job.feed, control));
  const ReplayEnd end = driven ? session.end(*driven) : session.end();
  Result<ReplayReport> report = (*replay)->finish(end);
  if (!driven) return tl::unexpected(driven.error());
  if (!report) return report;
  for (std::string& words : speed_warnings(job, files->route, setup.simulated.model))
    report->warnings.push_back(std::move(words));
  report->wall_s = watch.seconds();
  return report;
}

}  // namespace waymark
