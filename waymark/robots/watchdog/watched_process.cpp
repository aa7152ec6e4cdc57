#include "waymark/robots/watchdog/watched_process.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>

#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "waymark/robots/watchdog/watch_robot.hpp"

namespace waymark {

Result<std::string> find_watchdog() {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const fs::path folder = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  for (const fs::path& place :
       {folder / "waymark-watchdog", folder / "../libexec/waymark/waymark-watchdog"}) {
    if (fs::exists(place, ignored)) return place.lexically_normal().string();
  }
  return fail(ErrorCode::NotFound, "waymark-watchdog not found; robots cannot be driven without it",
              {.source = folder.string()}, "Install it next to waymark or in ../libexec/waymark.");
}

Result<std::unique_ptr<WatchedProcess>> WatchedProcess::start(const RobotCommand& command,
                                                              const std::string& watchdog) {
  const Result<std::string> program = watchdog.empty() ? find_watchdog() : Result<std::string>(watchdog);
  if (!program) return tl::unexpected(program.error());
  (void)std::signal(SIGPIPE, SIG_IGN);
  std::vector<std::string> words = {*program};
  if (command.listen_only) words.emplace_back(kListen);
  if (command.words.empty()) {
    words.push_back(command.shell);
  } else {
    words.emplace_back(kExec);
    words.insert(words.end(), command.words.begin(), command.words.end());
  }
  Result<Spawned> spawned = spawn(words);
  if (!spawned) return tl::unexpected(spawned.error());
  return std::unique_ptr<WatchedProcess>(new WatchedProcess(std::move(*spawned), command.text()));
}

WatchedProcess::~WatchedProcess() { (void)close(); }

Error WatchedProcess::ended() {
  const int code = close();
  constexpr int kNoSuchCommand = 127;
  Error error{.code = ErrorCode::Unreadable,
              .message = "the robot's process ended with " + ending_words(code),
              .place = {.source = "process:" + command_},
              .hint = "See its messages above, if any."};
  if (code == kNoSuchCommand) {
    error.code = ErrorCode::NotFound;
    error.message = "no such program";
  }
  if (code == kRobotClosedItsOutput) {
    error.message =
        "the robot closed its standard output while its process continued; it was stopped and ended";
    error.hint = "The robot must keep standard output open, because its samples arrive there.";
  }
  if (watchdog_died_) {
    error.message = "the watchdog, not the robot's process, ended with " + ending_words(code);
    error.hint = "Check that the robot has stopped; it should, because its input has ended.";
  }
  return error;
}

Status WatchedProcess::send(double speed_m_s, double yaw_rate_rad_s, std::int64_t step) {
  const std::string line = wire_line({++sequence_, steady_now(), speed_m_s, yaw_rate_rad_s, step});
  std::size_t written = 0;
  const bool gone = !watchdog_.to.open() || write_some(watchdog_.to.number(), line, written) == Moved::Ended;
  // The last lines explain the reason better, so read() first returns them and then the error.
  if (gone && !watchdog_.from.open()) return tl::unexpected(ended());
  return {};
}

Result<std::vector<Line>> WatchedProcess::read(Duration timeout) {
  std::vector<Line> lines;
  const auto take = [&] {
    while (auto line = lines_.next()) lines.push_back(std::move(*line));
  };
  const Duration deadline = steady_now() + timeout;
  while (watchdog_.from.open()) {
    std::string bytes;
    const Moved moved = read_some(watchdog_.from.number(), bytes);
    lines_.add(bytes);
    take();
    if (moved == Moved::Ended) {
      watchdog_.from.close();
      if (auto rest = lines_.rest()) lines.push_back(std::move(*rest));
    }
    const Duration left = deadline - steady_now();
    if (!lines.empty() || left <= Duration(0)) return lines;
    pollfd ready{watchdog_.from.number(), POLLIN, 0};
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(left).count();
    // Returns on a signal (Ctrl-C), so that the caller can check its flag.
    if (watchdog_.from.open() && poll(&ready, 1, static_cast<int>(std::min<std::int64_t>(ms, 1000))) < 0)
      return lines;
  }
  return tl::unexpected(ended());
}

Result<pid_t> WatchedProcess::drive_from_child(double speed_m_s, double yaw_rate_rad_s, double duration_s) {
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0)
    return fail(ErrorCode::LimitExceeded, std::string("cannot start a process: ") + std::strerror(errno));
  if (child > 0) {
    watchdog_.to.close();  // only the child holds the pipe, so the watchdog notices when the child ends
    return child;
  }
  (void)prctl(PR_SET_PDEATHSIG, static_cast<unsigned long>(SIGKILL));
  const Duration deadline = steady_now() + Duration(std::llround(duration_s * 1e9));
  while (getppid() == parent && steady_now() < deadline) {
    const std::string line = wire_line({++sequence_, steady_now(), speed_m_s, yaw_rate_rad_s, 0});
    std::size_t written = 0;
    if (write_some(watchdog_.to.number(), line, written) == Moved::Ended) break;
    (void)poll(nullptr, 0, 50);
  }
  _exit(0);
}

int WatchedProcess::close() {
  if (exit_code_) return *exit_code_;
  if (watchdog_.to.open()) {
    const std::string zero = wire_line({++sequence_, steady_now(), 0, 0, 0});
    std::size_t written = 0;
    (void)write_some(watchdog_.to.number(), zero, written);
  }
  watchdog_.to.close();
  watchdog_.from.close();
  const Duration deadline =
      steady_now() + std::chrono::seconds(8);  // the watchdog itself waits up to 3 times 2 s
  std::optional<int> status;
  while (!(status = wait_status(watchdog_.pid)) && steady_now() < deadline) (void)poll(nullptr, 0, 2);
  if (!status) (void)kill(watchdog_.pid, SIGKILL);  // frozen, but the end of its pipes stops the robot
  watchdog_died_ = status && WIFSIGNALED(*status);
  exit_code_ = status ? exit_code_of(*status) : 128 + SIGKILL;
  return *exit_code_;
}

}  // namespace waymark
