#include <utility>

#include <fmt/format.h>

#include "waymark/cli/estimate_message.hpp"
#include "waymark/cli/fresh_file.hpp"
#include "waymark/cli/live_replay.hpp"
#include "waymark/cli/live_story.hpp"
#include "waymark/cli/picture_recording.hpp"
#include "waymark/cli/robot_loop.hpp"

namespace waymark::cli {
namespace {

constexpr double kGiveUp_s = 5;

}  // namespace

Status LiveReplay::hear(const Sample& sample) {
  if (const auto* picture = std::get_if<CameraFrame>(&sample))
    return recorder_ ? record_picture(*picture, images_, *recorder_) : Status();
  if (const auto* frame = std::get_if<TagFrame>(&sample)) {
    replayer_.add(*frame);
    ++end.frames;
    end.frames_with_two_tags += frame->detections.size() >= 2 ? 1 : 0;
  }
  if (const auto* odometry = std::get_if<Odometry>(&sample)) replayer_.add(*odometry);
  if (const auto* imu = std::get_if<ImuSample>(&sample)) replayer_.add(*imu);
  if (const auto* scan = std::get_if<LaserScan>(&sample)) replayer_.add(*scan);
  if (const auto* truth = std::get_if<TruthPose>(&sample))
    true_path.push_back({truth->stamp, truth->map_T_base});
  return recorder_ ? recorder_->add(sample) : Status();
}

Result<std::optional<VelocityCommand>> LiveReplay::decide(Duration uptime, SensorTime now) {
  const ReplayStep step = replayer_.step(now);
  on_step(now, step);
  end.state = step.state;
  end.reason = step.reason.value_or("");
  const bool goes_on = step.state == ReplayState::Driving || step.state == ReplayState::AtStation;
  if (goes_on || !last_driving_) last_driving_ = uptime;
  driven_m = step.driven_m;
  if (Status status = notes_.add(now, step, recorder_ ? &*recorder_ : nullptr); !status)
    return tl::unexpected(status.error());
  if (paused_) last_driving_ = uptime;
  console_.live(fmt::format("{:.1f} of {:.1f} m{}{}. Ctrl-C stops the robot.", step.driven_m, goal_m_,
                            step.reason ? ", stands: " : "", step.reason.value_or("")));
  if (recorder_ && step.estimate) {
    Status status = recorder_->add_message(topics::kEstimate, now, estimate_message(*step.estimate));
    if (!status) return tl::unexpected(status.error());
  }
  const bool over = step.state == ReplayState::Finished || step.state == ReplayState::Refused ||
                    to_seconds(uptime - *last_driving_) >= kGiveUp_s;
  return over ? std::nullopt : std::optional(step.command);
}

void LiveReplay::pause() {
  paused_ = true;
  replayer_.pause("paused by the operator");
}

void LiveReplay::resume() {
  paused_ = false;
  replayer_.resume();
}

Stage as_known(const Stage& stage, const MapFile& map) {
  Stage known = stage;
  if (known.world_yaml.empty()) {
    known.simulated.world.anchor = map.anchor;
    known.simulated.world.tags = map.tags;
  }
  return known;
}

ReplayReport live_report(LiveReplay& replay, const Replayer& replayer, const Stage& known,
                         const ReplayFiles& files) {
  ReplayReport report{.end = replay.end,
                      .route_length_m = files.route.length_m,
                      .driven_m = replay.driven_m,
                      .true_path = std::move(replay.true_path),
                      .taught_path = files.taught,
                      .visits = replay.visits()};
  report.end.finished = report.end.state == ReplayState::Finished;
  report.end.stops = replayer.stops();
  report.warnings = replayer.problems();
  if (report.true_path.empty())
    report.warnings.emplace_back("nobody knows where the robot truly was: not judged");
  else
    judge(known, report);
  return report;
}

Result<ReplayReport> replay_live(const Stage& stage, const ReplayJob& job, Console& console) {
  const Stopwatch watch;
  const Result<ReplayFiles> files = load_replay(job);
  if (!files) return tl::unexpected(files.error());
  const auto replayer =
      make_replayer(*files, stage.simulated.model, stage.simulated.camera, with_lidar(job, stage));
  if (!replayer) return tl::unexpected(replayer.error());
  const Stage known = as_known(stage, files->map);
  Result<std::optional<SampleRecorder>> recorder = record_replay(known, job);
  if (!recorder) return tl::unexpected(recorder.error());
  FreshFile fresh(job.output);
  const auto robot = RobotLoop::open(stage.process, stage.simulated.camera, console);
  if (!robot) return tl::unexpected(robot.error());
  const Route& route = files->route;
  const double goal_m = route.length_m * (route.closed ? job.replay.laps : 1);
  LiveReplay replay(**replayer, *recorder, job.images, goal_m, console);
  RobotListener listener;
  listener.on_sample = [&](const Sample& sample) {
    fresh.hear(sample);
    return replay.hear(sample);
  };
  PhaseViewers viewers(job.feed, stage.simulated, OperatorState::Replaying);
  viewers.viewers().show_map(job.folder);
  viewers.viewers().watch(replay, goal_m);
  listener.decide = [&](Duration uptime, SensorTime now) -> Result<std::optional<VelocityCommand>> {
    const PhaseViewers::Wish wish = viewers.hear(uptime);
    if (wish.over) return std::optional<VelocityCommand>();
    if (wish.pause) *wish.pause ? replay.pause() : replay.resume();
    return replay.decide(uptime, now);
  };
  const auto driven = (*robot)->drive(watched(listener, job.feed));
  const Status closed = *recorder ? (*recorder)->close() : Status();
  console.end_progress();
  if (!driven) return tl::unexpected(driven.error());
  if (!closed) return tl::unexpected(closed.error());
  ReplayReport report = live_report(replay, **replayer, known, *files);
  for (std::string& words : speed_warnings(job, route)) report.warnings.push_back(std::move(words));
  report.end.interrupted = driven->interrupted;
  report.end.lap_s = driven->seconds;
  report.wall_s = watch.seconds();
  return report;
}

}  // namespace waymark::cli
