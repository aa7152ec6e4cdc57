#include "waymark/cli/operator_story.hpp"

#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "waymark/cli/live_replay.hpp"
#include "waymark/cli/live_robot.hpp"
#include "waymark/cli/live_story.hpp"
#include "waymark/cli/pilot.hpp"
#include "waymark/cli/stop_key.hpp"
#include "waymark/cli/story_files.hpp"
#include "waymark/cli/story_lap.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;
using A = OperatorAction;
using E = OperatorEvent;
using S = OperatorState;

class Story {
 public:
  Story(const Stage& stage, const StoryJob& job, std::unique_ptr<Pilot> pilot, Console& console)
      : stage_(stage),
        job_(job),
        pilot_(std::move(pilot)),
        console_(console),
        operator_({}, job.map.empty() ? S::Idle : S::Ready),
        map_folder_(job.map.empty() ? job.folder / "map" : fs::path(job.map)),
        viewers_(job.feed),
        stop_key_(job.driver == "keyboard" || job.driver == "lines") {
    viewers_.show_camera(stage.simulated);
  }

  /// With a map that is there already, when the job names one.
  Status load() { return job_.map.empty() ? Status() : load_map(); }
  void begin() {
    console_.say(pilot_->usage());
    std::error_code ignored;
    if (job_.map.empty() && fs::exists(map_folder_ / "map.yaml", ignored))
      console_.say(fmt::format("the map of an earlier story is in {0}: --map {0} begins with it",
                               map_folder_.string()));
    tell();
  }

  Status hear(const Sample& sample) {
    pilot_->hear(sample);
    if (taught_) return taught_->on_sample(sample);
    return replay_ ? replay_->session().hear(sample) : Status();
  }

  Result<DriverDecision> decide(Duration uptime, SensorTime now) {
    viewers_.tell(operator_, *pilot_);
    Result<PilotAct> act = pilot_->act(uptime, now, operator_.state());
    if (!act) return tl::unexpected(act.error());
    if (stop_key_.pressed()) act->events.insert(act->events.begin(), E::Stop);
    for (const std::string& words : act->words) console_.say(words);
    Status status = act->pad && taught_ ? taught_->on_sample(*act->pad) : Status();
    for (const E event : act->events) {
      if (status) status = happen(event, uptime);
    }
    if (status) status = look_at_map(uptime);
    Result<VelocityCommand> wanted = status ? replay(uptime, now) : tl::unexpected(status.error());
    if (!wanted) return tl::unexpected(wanted.error());
    return DriverDecision{.command = operator_.permit(act->command, *wanted),
                          .done = operator_.state() == S::Over};
  }

  /// Closes what is open, whatever happened.
  Status finish(bool interrupted) {
    Status lap = end_lap();
    Status replay = end_replay(interrupted);
    if (mapping_.under_way()) {
      const Status made = take_map();
      if (lap) lap = made;
    }
    report.state = to_string(operator_.state());
    report.reason = operator_.reason();
    return lap ? replay : lap;
  }

  StoryReport report{};

 private:
  void tell() {
    const S state = operator_.state();
    if (state == S::Over) return;
    console_.end_progress();
    const std::string& reason = operator_.reason();
    console_.say(fmt::format("{}{}{}. {}", to_string(state), reason.empty() ? "" : ": ", reason,
                             operator_.prompt(pilot_->buttons())));
  }

  /// While paused it is asked as well, so that it keeps its place; permit() lets nothing through.
  Result<VelocityCommand> replay(Duration uptime, SensorTime now) {
    const bool paused = operator_.state() == S::Paused;
    if (operator_.state() != S::Replaying && !paused) return VelocityCommand{};
    const Result<DriverDecision> decision = replay_->session().decide(uptime, now);
    if (!decision) return tl::unexpected(decision.error());
    if (paused || !decision->done) return decision->command;
    const ReplayEnd end = replay_->session().end();
    Status status =
        end.finished ? happen(E::ReplayFinished, uptime) : happen(E::ReplayStopped, uptime, end.reason);
    if (!status) return tl::unexpected(status.error());
    return VelocityCommand{};
  }

  Status happen(E event, Duration uptime, std::string reason = {}) {
    const S before = operator_.state();
    const Result<A> action = operator_.handle(event, uptime, std::move(reason));
    if (!action) {
      if (event != E::StickMoved) console_.say(action.error().message);
      return {};
    }
    Status status = act_on(*action);
    if (operator_.state() != before) tell();
    return status;
  }

  Status act_on(A action) {
    switch (action) {
      case A::StartLap:
        return start_lap();
      case A::FinishLap:
        return map_lap_now();
      case A::DropLap:
      case A::Leave:
      case A::EndReplay: {
        Status status = end_lap();
        return status ? end_replay(false) : status;
      }
      case A::StartReplay:
        return start_replay();
      case A::PauseReplay:
        replay_->session().pause();
        return {};
      case A::ResumeReplay:
        replay_->session().resume();
        return {};
      case A::Nothing:
        break;
    }
    return {};
  }

  Status start_lap() {
    lap_file_ = free_name(job_.folder, "lap");
    auto lap = StoryLap::start(stage_, job_, lap_file_, console_);
    if (!lap) return tl::unexpected(lap.error());
    taught_ = std::move(*lap);
    return {};
  }

  Status end_lap() {
    if (!taught_) return {};
    const auto lap = std::exchange(taught_, nullptr);
    return lap->end(console_);
  }

  /// On a thread of its own, so that the robot hears twenty times a second that it stands.
  Status map_lap_now() {
    if (Status status = end_lap(); !status) return status;
    ++report.laps_taught;
    mapping_.begin(lap_file_, map_folder_);
    return {};
  }

  Status look_at_map(Duration uptime) {
    if (!mapping_.ready()) return {};
    Status made = take_map();
    if (made) made = load_map();
    report.map_failed = !made;
    if (!made) return happen(E::MapFailed, uptime, to_string(made.error()));
    report.mapping_s.push_back(mapping_.seconds());
    console_.say(
        fmt::format("the map was made in {:.1f} s: {}", report.mapping_s.back(), map_folder_.string()));
    return happen(E::MapMade, uptime);
  }

  Status take_map() {
    const Result<std::string> kept = mapping_.take();
    if (!kept) return tl::unexpected(kept.error());
    if (!kept->empty()) console_.say("the map that was there is kept: " + *kept);
    return {};
  }

  Status load_map() {
    ReplayJob job = job_.replay;
    job.folder = map_folder_;
    Result<ReplayFiles> files = load_replay(job);
    if (!files) return tl::unexpected(files.error());
    files_.emplace(std::move(*files));
    viewers_.show_map(map_folder_);
    return {};
  }

  Status start_replay() {
    ReplayJob job = job_.replay;
    job.folder = map_folder_;
    job.output = free_name(job_.folder, "replay");
    job.images = job_.images;
    auto replay =
        LiveReplay::make(stage_, job, *files_, console_, viewers_.watch(goal_m(files_->route, job)));
    if (!replay) return tl::unexpected(replay.error());
    replay_ = std::move(*replay);
    return {};
  }

  Status end_replay(bool interrupted) {
    if (!replay_) return {};
    const auto replay = std::exchange(replay_, nullptr);
    ReplayEnd end = replay->session().end();
    end.interrupted = interrupted;
    if (interrupted) end.reason = "stopped by a signal";
    if (end.reason.empty())  // it drove on, and somebody ended it
      end.reason = operator_.state() == S::Over ? "the story was ended" : operator_.reason();
    Result<ReplayReport> made = replay->finish(end);
    if (!made) return tl::unexpected(made.error());
    report.replays.push_back(std::move(*made));
    return {};
  }

  const Stage& stage_;
  const StoryJob& job_;
  std::unique_ptr<Pilot> pilot_;
  Console& console_;
  Operator operator_;
  fs::path map_folder_;
  std::string lap_file_{};
  std::unique_ptr<StoryLap> taught_{};
  std::optional<ReplayFiles> files_{};
  std::unique_ptr<LiveReplay> replay_{};
  MapInTheMaking mapping_{};
  StoryViewers viewers_;
  StopKey stop_key_;
};

}  // namespace

Result<StoryReport> run_story(const Stage& stage, const StoryJob& job, Console& console) {
  auto pilot = Pilot::make(job.driver, job.speed_m_s, stage.simulated, job.feed);
  if (!pilot) return tl::unexpected(pilot.error());
  return run_story(stage, job, std::move(*pilot), console);
}

Result<StoryReport> run_story(const Stage& stage, const StoryJob& job, std::unique_ptr<Pilot> pilot,
                              Console& console) {
  const Stopwatch watch;
  Story story(stage, job, std::move(pilot), console);
  if (Status status = story.load(); !status) return tl::unexpected(status.error());
  std::error_code error;
  fs::create_directories(job.folder, error);
  if (error)
    return fail(ErrorCode::Unwritable, "cannot make the folder: " + error.message(),
                {.source = job.folder.string()});
  const auto robot = LiveRobot::open(stage.process, stage.simulated.camera, console);
  if (!robot) return tl::unexpected(robot.error());
  story.begin();
  RobotListener listener;
  listener.on_sample = [&](const Sample& sample) { return story.hear(sample); };
  listener.decide = [&](Duration uptime, SensorTime now) { return story.decide(uptime, now); };
  const auto driven = (*robot)->drive(watched(listener, job.feed));
  const Status closed = story.finish(driven && driven->interrupted);
  console.end_progress();
  if (!driven) return tl::unexpected(driven.error());
  if (!closed) return tl::unexpected(closed.error());
  StoryReport report = std::move(story.report);
  report.interrupted = driven->interrupted;
  report.wall_s = watch.seconds();
  return report;
}

}  // namespace waymark::cli
