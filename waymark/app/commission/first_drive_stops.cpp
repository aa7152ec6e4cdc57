#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <future>

#include <fmt/format.h>

#include "waymark/app/commission/commission_stop_trials.hpp"
#include "waymark/app/commission/first_drive.hpp"
#include "waymark/app/live/stop_key.hpp"
#include "waymark/robots/watchdog/command_watch.hpp"
#include "waymark/robots/watchdog/stop_socket.hpp"

namespace waymark {
namespace {

using V = CommissionVerdict;

constexpr const char* kNoPerson = "a person at the terminal (leave --yes out)";

/// A folder that is removed with all that is in it.
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

}  // namespace

/// Its socket stands in a folder of its own, so that no other drive of this user is stopped.
Status FirstDrive::stop_by_request() {
  const ScratchFolder folder;
  std::atomic<bool> asked{false};
  const auto socket = StopSocket::open(folder.path(), "first drive", [&] { asked = true; });
  if (!socket) return tl::unexpected(socket.error());
  std::future<std::vector<StopAnswer>> answers;
  const Duration began = steady_now();
  const auto trace =
      drive({.command = kFirstForward, .most_s = 4}, "stops: a request as of `waymark stop`", [&] {
        constexpr Duration kDriven = std::chrono::milliseconds(2000);
        if (!answers.valid() && steady_now() - began > kDriven)
          answers = std::async(std::launch::async,
                               [&] { return stop_all(folder.path(), std::chrono::seconds(2)); });
        return asked.load();
      });
  if (!trace) return tl::unexpected(trace.error());
  CommissionLine line = judge_stop("stop.request", timing_of(*trace), 0);
  if (!asked) line = {line.key, V::Fail, "a request to stop did not arrive", "waymark doctor"};
  add("stops", {line});
  return {};
}

/// A press before the wheels turn stops nothing that could be judged: the drive begins again.
Status FirstDrive::stop_by_key() {
  StopKey key(false);
  if (!person_.there || !key.watched()) {
    add("stops", {{"stop.key", V::Warn, "the space bar was not tried", kNoPerson}});
    return {};
  }
  constexpr int kTries = 3;
  bool pressed = false;
  MotionTiming timing;
  for (int tried = 0; tried < kTries && (tried == 0 || (pressed && !timing.response_s)); ++tried) {
    if (tried > 0) control_.note("stops: the space bar was pressed before the robot moved; once more");
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
  if (!pressed) line = {line.key, V::Fail, "nobody pressed the space bar for 10 s", kNoPerson};
  if (pressed && !timing.response_s)
    line = {line.key, V::Warn, "not judged: the space bar was pressed before the robot moved",
            "run it again"};
  add("stops", {line});
  return {};
}

Status FirstDrive::stop_by_silence() {
  if (Status opened = open(); !opened) return opened;
  control_.note("stops: no commands any more");
  const auto trace = fall_silent(robot_->process(), {.cancelled = control_.cancelled});
  if (!trace) return tl::unexpected(trace.error());
  const MotionTiming timing = timing_of(*trace);
  add("stops", {judge_stop("stop.silence", timing, command_timeout_s())});
  report_.figures.silence_stopping_s = timing.stopping_s;
  return {};
}

/// A robot whose process ended before it was seen standing is looked at again.
Status FirstDrive::see_again(MotionTiming& timing) {
  const Duration began = steady_now();
  if (Status opened = open(); !opened) return opened;
  constexpr double kLook_s = 1;
  const auto seen = look_at(robot_->process(), kLook_s, control_.cancelled);
  if (!seen) return tl::unexpected(seen.error());
  const bool stands =
      !seen->odometry.empty() && std::ranges::all_of(seen->odometry, [](const Odometry& odometry) {
        constexpr double kStill = 0.02;
        return std::abs(odometry.speed_m_s) < kStill;
      });
  timing.watched_s += to_seconds(steady_now() - began);
  if (stands) timing.stopping_s = timing.watched_s;
  return {};
}

Status FirstDrive::stop_by_kill() {
  if (Status opened = open(); !opened) return opened;
  control_.note("stops: the driving process is killed");
  const auto trace = kill_driver(robot_->process(), {.cancelled = control_.cancelled});
  robot_.reset();
  if (!trace) return tl::unexpected(trace.error());
  MotionTiming timing = timing_of(*trace);
  constexpr double kEnough_s = 1.3;
  bool late = false;
  if (timing.response_s && !timing.stopping_s && timing.watched_s < kEnough_s) {
    if (Status seen = see_again(timing); !seen) return seen;
    late = timing.stopping_s.has_value();
  }
  CommissionLine line = judge_stop("stop.kill", timing, command_timeout_s());
  if (late)
    line = {line.key, V::Warn,
            "the robot's process ended before it was seen standing; it stood when it was started again",
            "the robot's program, which must go on with odometry until `bye`"};
  add("stops", {line});
  if (!late) report_.figures.kill_stopping_s = timing.stopping_s;
  return {};
}

Status FirstDrive::lose_data() {
  if (!person_.there) {
    add("stops", {{"stop.cable", V::Warn, "pulling the cable was not tried", kNoPerson}});
    return {};
  }
  if (Status opened = open(); !opened) return opened;
  constexpr double kPatience_s = 30;
  control_.note(fmt::format(
      "stops: pull the cable of the robot, or switch off its radio, within {:g} s, or wait; the robot stands",
      kPatience_s));
  const auto silent_s = await_silence(robot_->process(), kPatience_s, control_.cancelled);
  if (!silent_s) return tl::unexpected(silent_s.error());
  if (*silent_s) {
    add("stops",
        {{"stop.cable", V::Ok, fmt::format("noticed {:.2f} s after the last odometry", **silent_s), ""}});
  } else if (person_.saw("Odometry went on coming. Was the cable pulled?").value_or(false)) {
    add("stops", {{"stop.cable", V::Fail, "odometry went on coming: the pulled cable was not noticed",
                   "the robot's program, which must not repeat old data"}});
  } else {
    add("stops", {{"stop.cable", V::Warn, "pulling the cable was not tried", "a cable or a radio to cut"}});
    return {};
  }
  return wait_for("Plug the cable in again, and wait until the robot is up.");
}

Status FirstDrive::try_stops() {
  if (Status opened = open(); !opened) return opened;
  if (robot_->process().hello().lockstep) {
    add("stops", {{"stop.kill", V::Warn, "not tried: the robot waits for its commands (lockstep)",
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

}  // namespace waymark
