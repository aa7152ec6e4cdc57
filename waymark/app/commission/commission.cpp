#include "waymark/app/commission/commission.hpp"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <poll.h>
#include <unistd.h>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "waymark/app/commission/stop_trials.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/base/error.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/robots/watchdog/stop_socket.hpp"
#include "waymark/robots/watchdog/watch_robot.hpp"
#include "waymark/runtime/commission_motion.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// Reads a line from standard input, without its newline. Fails at the end of the input, or if cancelled.
Result<std::string> typed_line(const std::function<bool()>& cancelled) {
  std::string line;
  while (!cancelled()) {
    pollfd ready{STDIN_FILENO, POLLIN, 0};
    constexpr int kSlice_ms = 100;
    if (poll(&ready, 1, kSlice_ms) <= 0) continue;
    char typed = 0;
    if (read(STDIN_FILENO, &typed, 1) != 1)
      return fail(ErrorCode::InvalidArgument, "standard input has ended, but answers are needed",
                  {.key = "yes"}, "Without a person, add `yes`; the robot must be where it may drive.");
    if (typed == '\n') return line;
    line += typed;
  }
  return fail(ErrorCode::Unreadable, "stopped");
}

constexpr VelocityCommand kFirstForward{.speed_m_s = 0.1, .yaw_rate_rad_s = 0};
constexpr VelocityCommand kFirstTurn{.speed_m_s = 0, .yaw_rate_rad_s = 0.4};

/// The steps of commission(), in order. Each step adds its findings; if it fails, the next one is impossible.
class FirstDrive {
 public:
  FirstDrive(const RobotSetup& setup, const CommissionJob& job, const CommissionPerson& person,
             const JobControl& control);

  /// With lifted wheels, drives forward and turns left.
  Status drive_lifted();
  /// Drives 0.5 m forward, turns 90 degrees to the left, and drives 0.3 m forward.
  Status drive_on_floor();
  /// For robots in real time, tests the stops: `waymark stop`, space bar, no commands, a killed driver, no
  /// data.
  Status try_stops();

  [[nodiscard]] CommissionReport& report() { return report_; }

 private:
  Status open();
  Status wait_for(const std::string& words);
  Result<MotionTrace> drive(
      const MotionOptions& options, const std::string& words,
      const std::function<bool()>& ends = [] { return false; });
  void add(const std::string& step, std::vector<CommissionLine> lines);
  Status stop_by_request();
  Status stop_by_key();
  Status stop_by_silence();
  Status stop_by_kill();
  Status check_rest_again(MotionTiming& timing);
  Status lose_data();

  const RobotSetup& setup_;
  const CommissionJob& job_;
  const CommissionPerson& person_;
  const JobControl& control_;
  TagWitness witness_{};
  std::unique_ptr<LiveRobot> robot_{};
  CommissionReport report_{};
};

TagWitness witness_of(const RobotSetup& setup, double tag_size_m) {
  TagWitness witness{.cameras = setup.simulated.cameras()};
  if (tag_size_m > 0) {
    witness.sizes.default_size_m = tag_size_m;
  } else {
    for (const auto& [id, tag] : setup.simulated.world.tags.tags)
      witness.sizes.size_by_tag_m[id] = tag.size_m;
  }
  return witness;
}

/// The ratio measured by the source with this origin, or else by the first one.
double ratio_of(const std::vector<MotionReading>& readings, const char* origin) {
  double ratio = 0;
  for (const MotionReading& reading : readings) {
    if (reading.origin == origin || ratio == 0) ratio = reading.ratio;
  }
  return ratio;
}

FirstDrive::FirstDrive(const RobotSetup& setup, const CommissionJob& job, const CommissionPerson& person,
                       const JobControl& control)
    : setup_(setup),
      job_(job),
      person_(person),
      control_(control),
      witness_(witness_of(setup, job.tag_size_m)) {}

Status FirstDrive::open() {
  if (robot_ != nullptr) return {};
  auto robot = LiveRobot::open_first(setup_, control_);
  if (!robot) return tl::unexpected(robot.error());
  robot_ = std::move(*robot);
  report_.real = robot_->process().hello().is_real();
  return report_.real && job_.output.empty() ? check_output_file(commission_file(setup_)) : Status();
}

Status FirstDrive::wait_for(const std::string& words) {
  robot_.reset();  // ensures that no process can drive while a person handles the robot
  return person_.ready(words);
}

void FirstDrive::add(const std::string& step, std::vector<CommissionLine> lines) {
  for (CommissionLine& line : lines) report_.findings.push_back({step, std::move(line)});
}

Result<MotionTrace> FirstDrive::drive(const MotionOptions& options, const std::string& words,
                                      const std::function<bool()>& ends) {
  if (Status opened = open(); !opened) return tl::unexpected(opened.error());
  control_.note(words);
  CommissionMotion motion(options, witness_);
  RobotListener listener;
  listener.on_sample = [&](const Sample& sample) {
    motion.receive(sample);
    return Status();
  };
  listener.decide = [&](Duration uptime, SensorTime now) {
    if (motion.moving() && ends()) motion.end_motion();
    return motion.decide(uptime, now);
  };
  listener.should_stop = control_.cancelled;
  const auto end = robot_->drive(std::move(listener));
  if (!end) return tl::unexpected(end.error());
  if (end->interrupted) return fail(ErrorCode::Unreadable, "stopped");
  return motion.trace();
}

Status FirstDrive::drive_lifted() {
  const RobotModel& model = setup_.simulated.model;
  if (Status ready = wait_for("Lift the robot so that its wheels turn freely."); !ready) return ready;
  const auto forward = drive({.command = kFirstForward}, "lifted: forward at 0.1 m/s for 2 s");
  if (!forward) return tl::unexpected(forward.error());
  add("lifted",
      judge_forward(*forward, model, Ground::Lifted, person_.confirm("Did all wheels turn forward?")));
  add("lifted", judge_standing(standing_part(*forward)));
  add("lifted", {judge_stop("stop.zero", timing_of(*forward), 0)});
  const auto turn = drive({.command = kFirstTurn}, "lifted: left at 0.4 rad/s for 2 s");
  if (!turn) return tl::unexpected(turn.error());
  add("lifted",
      judge_turn(*turn, model, Ground::Lifted,
                 person_.confirm("Did the right wheels turn forward and the left wheels backward?")));
  return {};
}

Status FirstDrive::drive_on_floor() {
  const RobotModel& model = setup_.simulated.model;
  if (Status ready = wait_for("Put the robot on the floor, with 1.5 m free ahead and to its left."); !ready)
    return ready;
  const auto forward =
      drive({.command = kFirstForward, .most_s = 7, .way = 0.5}, "floor: forward at 0.1 m/s, 0.5 m");
  if (!forward) return tl::unexpected(forward.error());
  add("floor", judge_forward(*forward, model, Ground::Floor,
                             person_.confirm("Did the robot drive half a metre forward?")));
  add("floor", judge_standing(standing_part(*forward)));
  const MotionTiming timing = timing_of(*forward);
  add("floor", {judge_response(timing), judge_stop("stop.zero", timing, 0)});
  const auto turn = drive({.command = kFirstTurn, .most_s = 12, .way = M_PI / 2, .far_m = 0.3},
                          "floor: 90 degrees to the left at 0.4 rad/s");
  if (!turn) return tl::unexpected(turn.error());
  add("floor",
      judge_turn(*turn, model, Ground::Floor, person_.confirm("Did the robot turn left by a quarter turn?")));
  const auto second =
      drive({.command = kFirstForward, .most_s = 4, .way = 0.3}, "floor: forward again, 0.3 m");
  if (!second) return tl::unexpected(second.error());
  std::vector<OdometryLeg> legs;
  constexpr double kSettle_s = 0.6;
  for (const MotionTrace* trace : {&*forward, &*second}) {
    if (const auto leg = odometry_leg(steady_part(*trace, kSettle_s))) legs.push_back(*leg);
  }
  add("floor", judge_axes(legs));
  const MotionTrace steady = steady_part(*turn, kSettle_s);
  report_.figures.response_s = timing.response_s;
  report_.figures.stopping_s = timing.stopping_s;
  if (timing.stopping_s) report_.figures.stopping_m = timing.stopping_m;
  report_.figures.speed_scale = ratio_of(forward_readings(steady_part(*forward, kSettle_s), model), "tags");
  report_.figures.yaw_rate_scale = ratio_of(turn_readings(steady, standing_part(*turn), model), "tags");
  return {};
}

using V = CommissionVerdict;

constexpr const char* kNoPerson = "a person at the terminal (omit `yes`)";

/// A temporary folder that is removed with its content.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "waymark-stop-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

double command_timeout_s() { return to_seconds(CommandWatchOptions{}.timeout); }

/// Uses a socket in a temporary folder, so that no other drive of this user is stopped.
Status FirstDrive::stop_by_request() {
  const ScratchFolder folder;
  std::atomic<bool> asked{false};
  const auto socket = StopSocket::open(folder.path(), "first drive", [&] { asked = true; });
  if (!socket) return tl::unexpected(socket.error());
  std::future<std::vector<StopAnswer>> answers;
  const Duration began = steady_now();
  const auto trace =
      drive({.command = kFirstForward, .most_s = 4}, "stops: a request like that of `waymark stop`", [&] {
        constexpr Duration kDriven = std::chrono::milliseconds(2000);
        if (!answers.valid() && steady_now() - began > kDriven)
          answers = std::async(std::launch::async,
                               [&] { return stop_all(folder.path(), std::chrono::seconds(2)); });
        return asked.load();
      });
  if (!trace) return tl::unexpected(trace.error());
  CommissionLine line = judge_stop("stop.request", timing_of(*trace), 0);
  if (!asked) line = {line.key, V::Fail, "the request to stop did not arrive", "waymark doctor"};
  add("stops", {line});
  return {};
}

/// Repeats the drive if the key was pressed before the wheels turned, because no stop can be measured in that
/// case.
Status FirstDrive::stop_by_key() {
  StopKey key(false);
  if (!person_.present || !key.watched()) {
    add("stops", {{"stop.key", V::Warn, "the space bar was not tested", kNoPerson}});
    return {};
  }
  constexpr int kTries = 3;
  bool pressed = false;
  MotionTiming timing;
  for (int attempt = 0; attempt < kTries && (attempt == 0 || (pressed && !timing.response_s)); ++attempt) {
    if (attempt > 0) control_.note("stops: the space bar was pressed before the robot moved; try again");
    pressed = false;
    const auto trace = drive({.command = kFirstForward, .most_s = 10},
                             "stops: press the space bar while the wheels turn", [&] {
                               pressed = pressed || key.pressed();
                               return pressed;
                             });
    if (!trace) return tl::unexpected(trace.error());
    timing = timing_of(*trace);
  }
  CommissionLine line = judge_stop("stop.key", timing, 0);
  if (!pressed) line = {line.key, V::Fail, "the space bar was not pressed within 10 s", kNoPerson};
  if (pressed && !timing.response_s)
    line = {line.key, V::Warn, "not tested: the space bar was pressed before the robot moved",
            "run the first drive again"};
  add("stops", {line});
  return {};
}

Status FirstDrive::stop_by_silence() {
  if (Status opened = open(); !opened) return opened;
  control_.note("stops: no more commands");
  const auto trace = fall_silent(robot_->process(), {.cancelled = control_.cancelled});
  if (!trace) return tl::unexpected(trace.error());
  const MotionTiming timing = timing_of(*trace);
  add("stops", {judge_stop("stop.silence", timing, command_timeout_s())});
  report_.figures.silence_stopping_s = timing.stopping_s;
  return {};
}

/// If the robot's process ended before the robot was seen to be stationary, starts it again and checks this.
Status FirstDrive::check_rest_again(MotionTiming& timing) {
  const Duration began = steady_now();
  if (Status opened = open(); !opened) return opened;
  constexpr double kLook_s = 1;
  const auto seen = observe_at_rest(robot_->process(), kLook_s, control_.cancelled);
  if (!seen) return tl::unexpected(seen.error());
  const bool stationary =
      !seen->odometry.empty() && std::ranges::all_of(seen->odometry, [](const Odometry& odometry) {
        constexpr double kStill = 0.02;
        return std::abs(odometry.speed_m_s) < kStill;
      });
  timing.watched_s += to_seconds(steady_now() - began);
  if (stationary) timing.stopping_s = timing.watched_s;
  return {};
}

Status FirstDrive::stop_by_kill() {
  if (Status opened = open(); !opened) return opened;
  control_.note("stops: the driving process is killed");
  const auto trace = kill_driver(robot_->process(), {.cancelled = control_.cancelled});
  robot_.reset();
  if (!trace) return tl::unexpected(trace.error());
  MotionTiming timing = timing_of(*trace);
  constexpr double kMinWatched_s = 1.3;
  bool late = false;
  if (timing.response_s && !timing.stopping_s && timing.watched_s < kMinWatched_s) {
    if (Status seen = check_rest_again(timing); !seen) return seen;
    late = timing.stopping_s.has_value();
  }
  CommissionLine line = judge_stop("stop.kill", timing, command_timeout_s());
  if (late)
    line = {
        line.key, V::Warn,
        "the robot's process ended before the stop was observed; the robot was stationary after a restart",
        "the robot's program, which must send odometry until `bye`"};
  add("stops", {line});
  if (!late) report_.figures.kill_stopping_s = timing.stopping_s;
  return {};
}

Status FirstDrive::lose_data() {
  if (!person_.present) {
    add("stops", {{"stop.cable", V::Warn, "pulling the cable was not tested", kNoPerson}});
    return {};
  }
  if (Status opened = open(); !opened) return opened;
  constexpr double kPatience_s = 30;
  control_.note(fmt::format(
      "stops: pull the cable of the stationary robot, or switch off its radio, within {:g} s; or wait",
      kPatience_s));
  const auto silent_s = await_silence(robot_->process(), kPatience_s, control_.cancelled);
  if (!silent_s) return tl::unexpected(silent_s.error());
  if (*silent_s) {
    add("stops",
        {{"stop.cable", V::Ok, fmt::format("detected {:.2f} s after the last odometry", **silent_s), ""}});
  } else if (person_.confirm("Odometry still arrived. Was the cable pulled?").value_or(false)) {
    add("stops", {{"stop.cable", V::Fail, "odometry still arrived: the pulled cable was not detected",
                   "the robot's program, which must not repeat old data"}});
  } else {
    add("stops",
        {{"stop.cable", V::Warn, "pulling the cable was not tested", "a cable or a radio to disconnect"}});
    return {};
  }
  return wait_for("Connect the cable again, and wait until the robot is ready.");
}

Status FirstDrive::try_stops() {
  if (Status opened = open(); !opened) return opened;
  if (robot_->process().hello().lockstep) {
    add("stops", {{"stop.kill", V::Warn, "not tested: the robot waits for its commands (lockstep)",
                   "a robot in real time"}});
    return {};
  }
  Status status = stop_by_request();
  if (status) status = stop_by_key();
  if (status) status = stop_by_silence();
  if (status) status = stop_by_kill();
  if (status) status = lose_data();
  return status;
}

bool nothing_failed(const CommissionReport& report) {
  return std::ranges::none_of(report.findings, [](const CommissionFinding& finding) {
    return finding.line.verdict == CommissionVerdict::Fail;
  });
}

/// Runs the steps until one fails. Returns true if the last step was run.
Result<bool> take_steps(FirstDrive& drive, const CommissionJob& job) {
  Status status;
  if (!job.skip_lifted) {
    status = drive.drive_lifted();
    if (status && nothing_failed(drive.report())) status = drive.try_stops();
    if (!status) return tl::unexpected(status.error());
    if (!nothing_failed(drive.report())) return false;
  }
  status = drive.drive_on_floor();
  if (status && job.skip_lifted && nothing_failed(drive.report())) status = drive.try_stops();
  if (!status) return tl::unexpected(status.error());
  return true;
}

CommissionRecord record_of(const CommissionReport& report, const RobotSetup& setup) {
  const RobotModel& model = setup.simulated.model;
  CommissionRecord record{.passed = report.passed,
                          .date = fmt::format("{:%Y-%m-%d}", fmt::gmtime(std::chrono::system_clock::now())),
                          .version = WAYMARK_VERSION,
                          .robot = setup.ground.robot,
                          .topics = setup.ground.topics,
                          .limits = model.limits,
                          .wheel_radius_m = model.wheel_radius_m,
                          .track_m = model.track_m,
                          .figures = report.figures};
  for (const CommissionFinding& finding : report.findings) {
    const bool listed = std::ranges::find(record.failed, finding.line.key) != record.failed.end();
    if (finding.line.verdict == CommissionVerdict::Fail && !listed) record.failed.push_back(finding.line.key);
  }
  return record;
}

/// Copies an existing file to NAME.1, or the next free number, and returns the name of the backup.
Result<std::string> back_up(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return std::string();
  for (int number = 1;; ++number) {
    const fs::path name = file.string() + fmt::format(".{}", number);
    if (fs::exists(name, error)) continue;
    fs::copy_file(file, name, error);
    if (!error) return name.string();
    return fail(ErrorCode::Unwritable, "cannot copy the robot's file: " + error.message(),
                {.source = name.string()}, "Choose another file with `output`.");
  }
}

Status write_result(CommissionReport& report, const RobotSetup& setup, const CommissionJob& job) {
  if (!report.real && job.output.empty()) return {};
  const fs::path file = job.output.empty() ? commission_file(setup) : job.output;
  const auto text = with_commission(setup.robot_yaml, record_of(report, setup));
  if (!text) return tl::unexpected(text.error());
  auto kept = back_up(file);
  if (!kept) return tl::unexpected(kept.error());
  if (Status written = write_text_file(file, *text); !written) return written;
  report.file = file.string();
  report.kept = std::move(*kept);
  return {};
}

}  // namespace

std::string commission_file(const RobotSetup& setup) {
  const fs::path path(setup.robot_path);
  const auto shared = find_shared("robots", path.stem().string());
  std::error_code ignored;
  const bool comes_with_program = shared && fs::equivalent(*shared, path, ignored);
  return comes_with_program ? path.filename().string() : path.string();
}

CommissionPerson person_at_terminal(const JobControl& control) {
  CommissionPerson person;
  person.present = true;
  person.ready = [control](const std::string& words) -> Status {
    control.note(words + " Then press Enter (Ctrl-C ends).");
    const auto line = typed_line(control.cancelled);
    return line ? Status() : tl::unexpected(line.error());
  };
  person.confirm = [control](const std::string& question) -> Seen {
    control.note(question + " y or n; Enter if you did not see it");
    const auto line = typed_line(control.cancelled);
    if (!line || line->empty()) return {};
    const int answer = std::tolower(static_cast<unsigned char>(line->front()));
    return answer == 'y' ? Seen(true) : answer == 'n' ? Seen(false) : Seen();
  };
  return person;
}

Result<CommissionReport> commission(const RobotSetup& setup, const CommissionJob& job,
                                    const CommissionPerson& person, const JobControl& control) {
  if (!job.output.empty())
    if (Status writable = check_output_file(job.output); !writable) return tl::unexpected(writable.error());
  FirstDrive drive(setup, job, person, control);
  const Result<bool> done = take_steps(drive, job);
  CommissionReport report = std::move(drive.report());
  report.interrupted = control.cancelled();
  if (report.interrupted) return report;
  if (!done) {
    Error error = done.error();
    const std::vector<std::string> fields = field_names<CommissionJob>();
    const bool of_job = std::ranges::find(fields, error.place.key) != fields.end();
    const bool of_message = !error.place.key.empty() && !of_job;
    if (report.findings.empty() && !of_message) return tl::unexpected(error);
    if (of_job)
      error.place.key = fmt::format("`{}`", error.place.key);  // because it is printed within a
                                                               // sentence
    report.findings.push_back(
        {"end",
         {of_message ? error.place.key : "drive", CommissionVerdict::Fail, to_string(error),
          of_message ? "the unit of this key in the robot's messages" : "the robot's program"}});
  }
  report.passed = done && *done && nothing_failed(report);
  if (Status written = write_result(report, setup, job); !written) return tl::unexpected(written.error());
  return report;
}

std::string to_text(const CommissionReport& report) {
  std::string text;
  for (const auto& [step, line] : report.findings) {
    text += fmt::format("{:<5} {:<7} {:<29} {}\n", to_string(line.verdict), step, line.key, line.message);
    if (!line.remedy.empty()) text += fmt::format("{:<44}fix: {}\n", "", line.remedy);
  }
  text += report.passed        ? "passed"
          : report.interrupted ? "stopped: the robot is stationary, nothing was written"
                               : "did not pass";
  if (!report.file.empty()) text += ", written to " + report.file;
  if (!report.kept.empty()) text += " (previous version: " + report.kept + ")";
  if (report.file.empty() && !report.interrupted)
    text += "; nothing was written, because the robot is simulated (see `output`)";
  return text + "\n";
}

ReportFields fields(const CommissionFinding& finding) {
  const CommissionLine& line = finding.line;
  return {{"step", "lifted, stops, floor or end", finding.step},
          {"check", "What was checked, such as odometry.yaw_rad or stop.kill", line.key},
          {"level", "ok, warn or fail", to_string(line.verdict)},
          {"message", "Result as a sentence", line.message},
          {"remedy", "Key or program to correct; empty: nothing to correct", line.remedy}};
}

namespace {

ReportFields fields_of(const CommissionFigures& figures) {
  return {{"response_s", "Time from a command to half the commanded speed", if_any(figures.response_s)},
          {"stopping_s", "Time from the zero command to rest, at 0.1 m/s", if_any(figures.stopping_s)},
          {"stopping_m", "Distance driven in that time", if_any(figures.stopping_m)},
          {"silence_stopping_s", "Time from the last command to rest", if_any(figures.silence_stopping_s)},
          {"kill_stopping_s", "Time from the end of the driving process to rest",
           if_any(figures.kill_stopping_s)},
          {"speed_scale", "Ratio of measured and commanded speed", if_any(figures.speed_scale)},
          {"yaw_rate_scale", "Ratio of measured and commanded yaw rate", if_any(figures.yaw_rate_scale)}};
}

}  // namespace

ReportFields fields(const CommissionReport& report) {
  return {{"passed", "No check failed, and the robot was driven on the floor", report.passed},
          {"interrupted", "Stopped before the end; nothing was written", report.interrupted},
          {"simulated", "The robot is simulated", !report.real},
          {"file", "Robot file with the result; empty: none was written", report.file},
          {"kept", "Backup of the earlier file; empty: there was none", report.kept},
          {"figures", "Measured values, as in the robot's file; only those that were measured",
           fields_of(report.figures)},
          {"findings", "One entry per check", report.findings}};
}

}  // namespace waymark
