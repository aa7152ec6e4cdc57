#include "waymark/app/commission/stop_trials.hpp"

#include <cmath>
#include <csignal>
#include <optional>
#include <utility>
#include <variant>

#include <sys/wait.h>

namespace waymark {
namespace {

constexpr Duration kOrderEvery = std::chrono::milliseconds(50);

Duration seconds(double value) { return Duration(std::llround(value * 1e9)); }

/// The child process that drives; killed when this object is destroyed.
class DrivingChild {
 public:
  explicit DrivingChild(pid_t pid) : pid_(pid) {}
  ~DrivingChild() { end(); }
  DrivingChild(const DrivingChild&) = delete;
  DrivingChild& operator=(const DrivingChild&) = delete;

  void end() {
    const pid_t pid = std::exchange(pid_, -1);
    if (pid <= 0) return;
    (void)kill(pid, SIGKILL);
    int ignored = 0;
    while (waitpid(pid, &ignored, 0) < 0 && errno == EINTR) {
    }
  }

 private:
  pid_t pid_;
};

/// Receives samples for this long and repeats the command, if there is one.
Status listen(ProcessRobot& robot, MotionTrace& trace, double for_s,
              const std::optional<VelocityCommand>& command, const std::function<bool()>& cancelled) {
  const Duration until = steady_now() + seconds(for_s);
  Duration due{};
  while (steady_now() < until) {
    if (cancelled()) {
      (void)robot.command({});
      return fail(ErrorCode::Unreadable, "stopped");
    }
    if (command && steady_now() >= due) {
      if (Status sent = robot.command(*command); !sent) return sent;
      due = steady_now() + kOrderEvery;
    }
    auto event = robot.next(kOrderEvery / 5);
    if (!event) return tl::unexpected(event.error());
    if (!*event) continue;
    if (const auto* sample = std::get_if<Sample>(&**event)) receive(trace, *sample, {});
  }
  return {};
}

/// Commands zero until data have arrived; returns the trace recorded so far.
Result<MotionTrace> rested(ProcessRobot& robot, const StopTrial& trial) {
  constexpr double kRest_s = 0.7;
  MotionTrace trace{.commanded = trial.command};
  if (Status rest = listen(robot, trace, kRest_s, VelocityCommand{}, trial.cancelled); !rest)
    return tl::unexpected(rest.error());
  trace.began = robot.now();
  if (!trace.began) return fail(ErrorCode::Unreadable, "the robot sends no data");
  return trace;
}

}  // namespace

Result<MotionTrace> fall_silent(ProcessRobot& robot, const StopTrial& trial) {
  auto trace = rested(robot, trial);
  if (!trace) return trace;
  Status status = listen(robot, *trace, trial.drives_s, trial.command, trial.cancelled);
  trace->ceased = robot.now();
  if (status) status = listen(robot, *trace, trial.watched_s, {}, trial.cancelled);
  (void)robot.command({});
  if (!status) return tl::unexpected(status.error());
  return trace;
}

Result<MotionTrace> kill_driver(ProcessRobot& robot, const StopTrial& trial) {
  auto trace = rested(robot, trial);
  if (!trace) return trace;
  const auto pid = robot.drive_from_child(trial.command, 4 * trial.drives_s);
  if (!pid) return tl::unexpected(pid.error());
  DrivingChild child(*pid);
  if (Status status = listen(robot, *trace, trial.drives_s, {}, trial.cancelled); !status)
    return tl::unexpected(status.error());
  child.end();
  trace->ceased = robot.now();
  constexpr double kEnding_s = 6;  // longer than the watchdog waits before ending the robot's process
  (void)listen(robot, *trace, kEnding_s, {}, trial.cancelled);
  if (trial.cancelled()) return fail(ErrorCode::Unreadable, "stopped");
  return trace;
}

Result<std::optional<double>> await_silence(ProcessRobot& robot, double most_s,
                                            const std::function<bool()>& cancelled) {
  constexpr double kSilent_s = 0.5;
  const Duration until = steady_now() + seconds(most_s);
  Duration last_data = steady_now();
  std::size_t count = 0;
  MotionTrace trace;
  while (steady_now() < until) {
    const Status status = listen(robot, trace, to_seconds(kOrderEvery), VelocityCommand{}, cancelled);
    if (cancelled()) return fail(ErrorCode::Unreadable, "stopped");
    if (status && trace.odometry.size() > count) last_data = steady_now();
    count = trace.odometry.size();
    const double silent_s = to_seconds(steady_now() - last_data);
    if (!status || silent_s >= kSilent_s) return std::optional<double>(silent_s);
  }
  return std::optional<double>();
}

Result<MotionTrace> observe_at_rest(ProcessRobot& robot, double for_s,
                                    const std::function<bool()>& cancelled) {
  MotionTrace trace;
  if (Status status = listen(robot, trace, for_s, VelocityCommand{}, cancelled); !status)
    return tl::unexpected(status.error());
  return trace;
}

}  // namespace waymark
