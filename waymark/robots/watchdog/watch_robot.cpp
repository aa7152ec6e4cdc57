#include "waymark/robots/watchdog/watch_robot.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <vector>

#include <poll.h>
#include <unistd.h>

#include <fmt/format.h>

#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr std::string_view kCommandPrefix = "command ";

template <class Number>
bool take(std::string_view& text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  if (!text.empty() && text.front() != ' ') return false;
  if (!text.empty()) text.remove_prefix(1);
  return true;
}

}  // namespace

std::string wire_line(const WireCommand& command) {
  return fmt::format("{}{} {} {} {} {}\n", kCommandPrefix, command.sequence, command.given.count(),
                     command.speed_m_s, command.yaw_rate_rad_s, command.step);
}

Result<WireCommand> parse_wire_line(std::string_view line) {
  WireCommand command;
  std::int64_t given_ns = 0;
  std::string_view rest = line;
  const bool ours = rest.starts_with(kCommandPrefix);
  if (ours) rest.remove_prefix(kCommandPrefix.size());
  const bool read = ours && take(rest, command.sequence) && take(rest, given_ns) &&
                    take(rest, command.speed_m_s) && take(rest, command.yaw_rate_rad_s) &&
                    take(rest, command.step) && rest.empty() && line.back() != ' ';
  if (!read || !std::isfinite(command.speed_m_s) || !std::isfinite(command.yaw_rate_rad_s))
    return fail(ErrorCode::Unreadable, fmt::format("invalid command: '{}'", line.substr(0, 80)));
  command.given = Duration(given_ns);
  return command;
}

std::string order_line(const RobotOrder& order) {
  std::string line =
      fmt::format(R"({{"type":"velocity","sequence":{},"speed_m_s":{},"yaw_rate_rad_s":{},"age_s":{:.6f})",
                  order.sequence, order.speed_m_s, order.yaw_rate_rad_s, order.age_s);
  if (order.step != 0) line += fmt::format(R"(,"step":{})", order.step);
  if (order.reason != nullptr) line += fmt::format(R"(,"stop":"{}")", order.reason);
  return line + "}\n";
}

bool CommandWatch::offer(const WireCommand& command, Duration now) {
  const bool finite = std::isfinite(command.speed_m_s) && std::isfinite(command.yaw_rate_rad_s);
  if (!finite || command.sequence <= newest_.sequence || command.given > now) return false;
  if (now - command.given > options_.timeout || given_up_) return false;
  newest_ = command;
  passed_on_ = false;
  return true;
}

std::optional<RobotOrder> CommandWatch::due(Duration now) {
  if (fresh(now)) {
    if (passed_on_) return std::nullopt;
    passed_on_ = true;
    last_zero_.reset();
    return RobotOrder{.sequence = newest_.sequence,
                      .speed_m_s = newest_.speed_m_s,
                      .yaw_rate_rad_s = newest_.yaw_rate_rad_s,
                      .age_s = to_seconds(now - newest_.given),
                      .step = newest_.step};
  }
  if (last_zero_ && now - *last_zero_ < options_.repeat) return std::nullopt;
  last_zero_ = now;
  passed_on_ = true;
  const char* reason = given_up_               ? "the driving program has exited"
                       : newest_.sequence == 0 ? "no command yet"
                                               : "no fresh command";
  return RobotOrder{.sequence = newest_.sequence, .reason = reason};
}

Duration CommandWatch::next(Duration now) const {
  if (fresh(now)) return passed_on_ ? newest_.given + options_.timeout + Duration(1) : now;
  return last_zero_ ? *last_zero_ + options_.repeat : now;
}

namespace {

constexpr std::size_t kMaxCommandBytes = 256;
constexpr Duration kUnreadPoll = std::chrono::milliseconds(2);
constexpr Duration kHeartbeat = std::chrono::milliseconds(50);

volatile std::sig_atomic_t asked_to_end = 0;
extern "C" void ask_to_end(int /*signal*/) { asked_to_end = 1; }

/// Ignores signals from the terminal: the watchdog ends when its input is closed, or on SIGTERM.
void set_signals() {
  for (const int signal : {SIGINT, SIGQUIT, SIGHUP, SIGPIPE}) (void)std::signal(signal, SIG_IGN);
  struct sigaction on_term {};
  on_term.sa_handler = ask_to_end;
  sigaction(SIGTERM, &on_term, nullptr);
}

class Watchdog {
 public:
  Watchdog(Spawned robot, const WatchRobotOptions& options, bool listen_only)
      : robot_(std::move(robot)),
        options_(options),
        watch_(options.watch),
        parent_(getppid()),
        listen_only_(listen_only) {
    never_wait(STDIN_FILENO);
    never_wait(STDOUT_FILENO);
    hello_ = fmt::format("{{\"type\":\"hello\",\"protocol_version\":1,\"command_timeout_s\":{}{}}}\n",
                         to_seconds(options.watch.timeout), listen_only ? ",\"listen_only\":true" : "");
  }

  int run() {
    while (!over()) {
      wait();
      const Duration now = steady_now();
      read_driver(now);
      read_robot();
      write_driver();
      write_robot(now);
    }
    return end();
  }

 private:
  void wait() {
    const Duration now = steady_now();
    Duration until = listen_only_ ? kHeartbeat : std::min(kHeartbeat, watch_.next(now) - now);
    if (robot_.to.open() && until <= Duration(0))
      until = kUnreadPoll;  // a command is due, but the robot is not reading
    std::array<pollfd, 3> fds{{{driver_gone_at_ ? -1 : STDIN_FILENO, POLLIN, 0},
                               {queue_.empty() || reader_gone_ ? -1 : STDOUT_FILENO, POLLOUT, 0},
                               {robot_.from.number(), POLLIN, 0}}};
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(until).count();
    (void)poll(fds.data(), fds.size(), static_cast<int>(std::clamp<std::int64_t>(ms, 0, 50)));
  }

  void driver_gone(Duration now) {
    if (driver_gone_at_) return;
    driver_gone_at_ = now;
    watch_.give_up();
  }

  void read_driver(Duration now) {
    if (asked_to_end != 0 || getppid() != parent_) driver_gone(now);
    if (driver_gone_at_) return;
    std::string bytes;
    const Moved moved = read_some(STDIN_FILENO, bytes);
    commands_.add(bytes);
    while (const auto line = commands_.next()) {
      const auto command = parse_wire_line(line->text);
      if (command) (void)watch_.offer(*command, now);
    }
    if (moved == Moved::Ended) driver_gone(now);
  }

  void read_robot() {
    if (!robot_.from.open()) return;
    std::string bytes;
    const Moved moved = read_some(robot_.from.number(), bytes);
    lines_.add(bytes);
    const auto forward = [this](Line line) {
      // One byte more than the limit marks the line as too long for the driver.
      if (line.too_long) line.text += '.';
      if (!reader_gone_) queue_.push(std::move(line.text) + '\n');
    };
    while (auto line = lines_.next()) forward(std::move(*line));
    if (moved != Moved::Ended) return;
    robot_.from.close();
    if (auto line = lines_.rest()) forward(std::move(*line));
    // Without its samples the robot cannot be driven, so zero is sent from now on and then its process is
    // ended.
    mute_at_ = steady_now();
    watch_.give_up();
  }

  void write_driver() {
    while (!reader_gone_ && !queue_.empty()) {
      std::size_t written = 0;
      const Moved moved = write_some(STDOUT_FILENO, queue_.front(), written);
      reader_gone_ = moved == Moved::Ended;
      if (reader_gone_) driver_gone(steady_now());
      if (moved != Moved::Some) return;
      queue_.pop(written);
    }
    if (!mute_at_ || !queue_.empty() || output_closed_) return;
    (void)close(STDOUT_FILENO);  // lets the driver notice immediately
    output_closed_ = true;
  }

  /// Writes the next order only after the robot has read the last one, so that a slow robot never executes a
  /// queue of outdated orders.
  void write_robot(Duration now) {
    if (!robot_.to.open()) return;
    if (!hello_.empty()) {
      write_line(hello_);
      hello_.clear();
    }
    if (listen_only_ || !all_read(robot_.to.number())) return;
    if (const auto order = watch_.due(now)) write_line(order_line(*order));
  }

  void write_line(const std::string& line) {
    std::size_t written = 0;  // shorter than PIPE_BUF, so it is written either as a whole or not at all
    if (write_some(robot_.to.number(), line, written) == Moved::Ended) robot_.to.close();
  }

  [[nodiscard]] bool over() {
    status_ = wait_status(robot_.pid);
    if (status_ || !robot_.to.open()) return true;  // a robot that does not read cannot be stopped by orders
    const Duration now = steady_now();
    closed_output_ = mute_at_ && now - *mute_at_ >= options_.farewell;
    return closed_output_ || (driver_gone_at_ && now - *driver_gone_at_ >= options_.farewell);
  }

  /// Waits for the robot process to end until `deadline`, forwarding its lines in the meantime.
  bool ended_by(Duration deadline) {
    while (!status_ && steady_now() < deadline) {
      read_robot();
      write_driver();
      (void)poll(nullptr, 0, 5);
      status_ = wait_status(robot_.pid);
    }
    return status_.has_value();
  }

  int end() {
    if (!status_) {
      if (robot_.to.open()) write_line("{\"type\":\"bye\"}\n");
      robot_.to.close();
      if (!ended_by(steady_now() + options_.patience)) {
        (void)kill(-robot_.pid, SIGTERM);
        if (!ended_by(steady_now() + options_.patience)) {
          (void)kill(-robot_.pid, SIGKILL);
          (void)ended_by(steady_now() + options_.patience);
        }
      }
    }
    (void)kill(-robot_.pid, SIGTERM);  // also ends its remaining child processes
    const Duration deadline = steady_now() + options_.patience;
    do {  // forwards its last lines
      read_robot();
      write_driver();
    } while (!driver_gone_at_ && (robot_.from.open() || !queue_.empty()) && steady_now() < deadline &&
             poll(nullptr, 0, 1) == 0);
    if (queue_.dropped() > 0)
      fmt::print(stderr,
                 "waymark-watchdog: dropped {} lines of the robot, because they were not read in time\n",
                 queue_.dropped());
    if (closed_output_) return kRobotClosedItsOutput;
    return status_ ? exit_code_of(*status_) : 128 + SIGKILL;
  }

  Spawned robot_;
  WatchRobotOptions options_;
  CommandWatch watch_;
  pid_t parent_;
  bool listen_only_;
  std::string hello_;
  LineSplitter commands_{kMaxCommandBytes};
  LineSplitter lines_{};
  LineQueue queue_{};
  std::optional<Duration> driver_gone_at_{};
  bool reader_gone_ = false;           ///< the reader of the robot's lines; the driver may disconnect earlier
  std::optional<Duration> mute_at_{};  ///< when the robot's standard output ended
  bool output_closed_ = false;         ///< whether all of it has been forwarded
  bool closed_output_ = false;         ///< whether its process continued after that
  std::optional<int> status_{};
};

}  // namespace

int watch_robot(const RobotCommand& command, const WatchRobotOptions& options) {
  set_signals();
  Result<Spawned> robot =
      spawn(command.words.empty() ? std::vector<std::string>{"/bin/sh", "-c", command.shell} : command.words);
  if (!robot) {
    fmt::print(stderr, "waymark-watchdog: {}\n", to_string(robot.error()));
    return kRobotCannotStart;
  }
  return Watchdog(std::move(*robot), options, command.listen_only).run();
}

}  // namespace waymark
