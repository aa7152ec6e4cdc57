#include "waymark/app/session/run_session.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/app/replay/replay_route.hpp"
#include "waymark/app/teach/teach_lap.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {

namespace fs = std::filesystem;

std::string free_name(const fs::path& folder, const std::string& stem) {
  fs::path path = folder / (stem + ".mcap");
  std::error_code ignored;
  for (int number = 2; fs::exists(path, ignored); ++number)
    path = folder / fmt::format("{}.{}.mcap", stem, number);
  return path.string();
}

namespace {

/// The folder in which a map is created before that folder is renamed.
fs::path beside(const fs::path& folder) { return folder.string() + ".new"; }

Result<std::string> replace_folder(const fs::path& folder, const fs::path& fresh) {
  std::error_code error;
  fs::path kept;
  if (fs::exists(folder, error)) {
    int number = 1;
    const auto numbered = [&] { return fs::path(fmt::format("{}.{}", folder.string(), number)); };
    while (fs::exists(numbered(), error)) ++number;
    kept = numbered();
    fs::rename(folder, kept, error);
  }
  if (!error) fs::rename(fresh, folder, error);
  if (!error) return kept.string();
  std::error_code ignored;
  if (!kept.empty() && !fs::exists(folder, ignored))
    fs::rename(kept, folder, ignored);  // restore the previous
                                        // folder
  return fail(ErrorCode::Unwritable, "cannot rename the folder of the new map: " + error.message(),
              {.source = folder.string()});
}

}  // namespace

void MapInTheMaking::begin(const MapMaker& make, const std::string& lap, const fs::path& folder) {
  began_ = std::chrono::steady_clock::now();
  folder_ = folder;
  std::error_code ignored;
  fs::remove_all(beside(folder), ignored);
  made_ = std::async(std::launch::async,
                     [make, lap, fresh = beside(folder)]() -> Status { return make(lap, fresh); });
}

double MapInTheMaking::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
}

bool MapInTheMaking::ready() const {
  return made_.valid() && made_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

Result<std::string> MapInTheMaking::take() {
  if (Status made = made_.get(); !made) {
    std::error_code ignored;
    fs::remove_all(beside(folder_), ignored);
    return tl::unexpected(made.error());
  }
  return replace_folder(folder_, beside(folder_));
}

namespace {

/// Calls map_recording() without printing notes; may be used on any thread.
MapMaker map_quietly(std::function<bool()> cancelled) {
  return [cancelled = std::move(cancelled)](const std::string& lap, const fs::path& folder) -> Status {
    JobControl control;
    control.cancelled = cancelled;
    const Result<MapReport> mapped = map_recording({.lap = lap, .folder = folder}, control);
    return mapped ? Status() : tl::unexpected(mapped.error());
  };
}

/// The lap being recorded.
class RecordedSessionLap {
 public:
  RecordedSessionLap(SampleRecorder recorder, const RobotSetup& setup, const SessionJob& job,
                     const JobControl& control)
      : recorder_(std::move(recorder)),
        lap_(lap_of(setup.simulated, lap_listener(recorder_, job.images, control))) {}
  Status add(const Sample& sample) { return lap_.receive(sample); }
  /// Closes the file and prints the warnings for the lap as notes.
  Status close(const JobControl& control) {
    const Status closed = recorder_.close();
    for (const std::string& warning : lap_.summary().warnings) control.note("warning: " + warning);
    return closed;
  }

 private:
  SampleRecorder recorder_;
  LapMonitor lap_;
};

/// The recordings, maps and notes of an operator's session.
class SessionTasks final : public OperatorTasks {
 public:
  SessionTasks(const RobotSetup& setup, const SessionJob& job, const JobControl& control)
      : setup_(setup),
        job_(job),
        control_(control),
        map_folder_(job.map.empty() ? job.folder / "map" : fs::path(job.map)),
        viewers_(job.feed) {
    viewers_.show_camera(setup.simulated);
  }

  /// Limits the speed of replays.
  void limit_speed(double most_m_s) { most_m_s_ = most_m_s; }

  void begin(const OperatorInput& input) {
    control_.note(input.usage());
    std::error_code ignored;
    if (job_.map.empty() && fs::exists(map_folder_ / "map.yaml", ignored))
      control_.note(fmt::format("{0} contains the map of an earlier session; to use it, set `map={0}`",
                                map_folder_.string()));
  }

  Status start_lap() override {
    lap_file_ = free_name(job_.folder, "lap");
    Result<SampleRecorder> recorder =
        start_recording(lap_file_,
                        {.verb = "run",
                         .driver = job_.driver,
                         .options = fmt::format("driver:\n  speed_m_s: {}\n", job_.speed_m_s),
                         .durable = job_.replay.durable},
                        setup_);
    if (!recorder) return tl::unexpected(recorder.error());
    lap_ = std::make_unique<RecordedSessionLap>(std::move(*recorder), setup_, job_, control_);
    return {};
  }
  Status add_to_lap(const Sample& sample) override { return lap_->add(sample); }
  Status end_lap() override { return std::exchange(lap_, nullptr)->close(control_); }

  Status start_map() override {
    mapping_.begin(job_.make_map ? job_.make_map : map_quietly(control_.cancelled), lap_file_, map_folder_);
    return {};
  }
  bool map_ended() const override { return mapping_.ready(); }
  Status take_map() override {
    const Result<std::string> kept = mapping_.take();
    if (!kept) return tl::unexpected(kept.error());
    if (!kept->empty()) control_.note("the previous map was renamed to " + *kept);
    taken_ = true;
    return {};
  }
  Status load_map() override {
    ReplayJob job = job_.replay;
    job.folder = map_folder_;
    Result<ReplayFiles> files = load_replay(job, control_);
    if (!files) return tl::unexpected(files.error());
    if (Status drivable = check_drivable(*files); !drivable) return drivable;
    note_near_tags(*files, setup_.simulated.model, job, control_);
    files_.emplace(std::move(*files));
    viewers_.show_map(map_folder_);
    if (!std::exchange(taken_, false)) return {};
    mapping_s.push_back(mapping_.seconds());
    control_.note(fmt::format("map made in {:.1f} s: {}", mapping_s.back(), map_folder_.string()));
    return {};
  }

  Result<ReplaySession*> start_replay() override {
    ReplayJob job = slowed(job_.replay, most_m_s_);
    job.folder = map_folder_;
    job.output = free_name(job_.folder, "replay");
    job.images = job_.images;
    auto replay =
        LiveReplay::make(setup_, job, *files_, control_, viewers_.watch(goal_m(files_->route, job)));
    if (!replay) return tl::unexpected(replay.error());
    replay_ = std::move(*replay);
    return &replay_->session();
  }
  Status end_replay(const ReplayEnd& end) override {
    const auto replay = std::exchange(replay_, nullptr);
    Result<ReplayReport> made = replay->finish(end);
    if (!made) return tl::unexpected(made.error());
    replays.push_back(std::move(*made));
    return {};
  }

  void on_state(const Operator& session, const OperatorButtons& buttons) override {
    const std::string state = with_reason(to_string(session.state()), session.reason());
    control_.note(fmt::format("{}{} {}", state, state.ends_with('.') ? "" : ".", session.prompt(buttons)));
  }
  void on_decision(const Operator& session, const OperatorInput& input) override {
    viewers_.show_status(session, input);
  }
  void on_message(const std::string& words) override { control_.note(words); }

  std::vector<double> mapping_s{};
  std::vector<ReplayReport> replays{};

 private:
  const RobotSetup& setup_;
  const SessionJob& job_;
  const JobControl& control_;
  fs::path map_folder_;
  std::string lap_file_{};
  std::unique_ptr<RecordedSessionLap> lap_{};
  std::optional<ReplayFiles> files_{};
  std::unique_ptr<LiveReplay> replay_{};
  MapInTheMaking mapping_{};
  double most_m_s_ = std::numeric_limits<double>::infinity();
  bool taken_ = false;  ///< whether a map has been installed but not yet loaded
  SessionViewers viewers_;
};

/// Creates the folder. Returns true if it did not exist.
Result<bool> make_folder(const fs::path& folder) {
  std::error_code error;
  const bool made = fs::create_directories(folder, error);
  if (!error) return made;
  return fail(ErrorCode::Unwritable, "cannot create the folder: " + error.message(),
              {.source = folder.string()});
}

}  // namespace

Status check_session(const SessionJob& job) {
  if (job.replay.route.empty() || !job.map.empty()) return {};
  return fail(ErrorCode::InvalidArgument, "a route needs an existing map", {.key = "route"},
              "Add `map` with the map that has this route.");
}

Result<SessionReport> run_session(const RobotSetup& setup, const SessionJob& job, const JobControl& control) {
  auto input = make_operator_input(job.driver, job.speed_m_s, setup.simulated, viewer_link(job.feed));
  if (!input) return tl::unexpected(input.error());
  return run_session(setup, job, std::move(*input), control);
}

Result<SessionReport> run_session(const RobotSetup& setup, const SessionJob& job,
                                  std::unique_ptr<OperatorInput> input, const JobControl& control) {
  const Stopwatch watch;
  StopKey stop_key(job.driver == "keyboard" || job.driver == "lines");
  SessionTasks tasks(setup, job, control);
  if (const Status loaded = job.map.empty() ? Status() : tasks.load_map(); !loaded)
    return tl::unexpected(loaded.error());
  const auto made = make_folder(job.folder);
  if (!made) return tl::unexpected(made.error());
  const auto robot = LiveRobot::open(setup, control);
  if (!robot) {
    std::error_code ignored;
    if (*made) fs::remove(job.folder, ignored);  // only if it is still empty
    return tl::unexpected(robot.error());
  }
  OperatorSession session(*input, tasks, !job.map.empty(), [&] { return stop_key.pressed(); });
  tasks.limit_speed((*robot)->speed_limit_m_s());
  tasks.begin(*input);
  session.begin();
  const auto driven = (*robot)->drive(watched(session.listener(), job.feed, control));
  const Status closed = session.finish(driven && driven->interrupted);
  if (!driven) return tl::unexpected(driven.error());
  if (!closed) return tl::unexpected(closed.error());
  return SessionReport{.laps_taught = session.laps_taught(),
                       .mapping_s = std::move(tasks.mapping_s),
                       .map_failed = session.map_failed(),
                       .replays = std::move(tasks.replays),
                       .interrupted = driven->interrupted,
                       .state = std::string(to_string(session.state())),
                       .reason = session.reason(),
                       .wall_s = watch.seconds()};
}

Status check_effects(const RunRequest& request, const RobotSetup& setup, bool view,
                     const GivenFields& given) {
  const bool process = !setup.process.empty();
  FieldRefusals refused(given);
  refused.fields(process, {"images"}, "has no effect on a robot process", "Omit `images`.");
  refused.fields(process || !view, {"pace"}, "only applies to a simulated robot with `view`",
                 "Omit `pace`, or use `view` with a simulated robot.");
  refused.fields(request.job.driver == "lines", {"speed_m_s"},
                 "has no effect: the driver lines specifies each speed", "Omit `speed_m_s`.");
  const bool scripted = request.job.driver == "scripted" || request.job.driver == "page" || view;
  refuse_seed(process && !scripted, refused);
  return refused.status() ? check_recorded_images(process || request.images, request.job.images)
                          : refused.status();
}

bool succeeded(const SessionReport& report) {
  return !report.map_failed &&
         std::ranges::all_of(report.replays, [](const ReplayReport& replay) { return succeeded(replay); });
}

std::string to_text(const SessionReport& report, std::string_view stopped_by) {
  std::string text = fmt::format("{} taught, {}\n", counted(report.laps_taught, "lap"),
                                 counted(report.replays.size(), "replay"));
  for (const ReplayReport& replay : report.replays) {
    text += ending(replay, stopped_by);
    if (replay.judgement)
      text += fmt::format("; cross-track error {:.3f} m rmse, {:.3f} m max by ground truth",
                          replay.judgement->cross_track_rmse_m, replay.judgement->cross_track_max_m);
    text += '\n';
  }
  return text;
}

ReportFields fields(const SessionReport& report) {
  return {{"laps_taught", "Laps that were taught", report.laps_taught},
          {"mapping_s", "Time from the end of each lap to its map", report.mapping_s},
          {"replays", "One entry per replay, as `waymark replay` prints it", report.replays},
          {"state", "Last state of the session", report.state},
          {"reason", "Why the last replay or map ended as it did; empty: no problem", report.reason},
          {"wall_s", "Elapsed real time", report.wall_s}};
}

}  // namespace waymark
