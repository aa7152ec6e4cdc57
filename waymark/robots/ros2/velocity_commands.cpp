#include "waymark/robots/ros2/velocity_commands.hpp"

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/dds/ros_names.hpp"

namespace waymark {

std::vector<std::uint8_t> velocity_message(const StampedCommand& command, bool stamped) {
  const ros2::TwistStamped message = ros2::to_ros(command);
  return stamped ? cdr::encode(message) : cdr::encode(message.twist);
}

std::vector<std::uint8_t> velocity_message_now(const VelocityCommand& command, bool stamped) {
  const auto now = std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch());
  return velocity_message({SensorTime(now), command}, stamped);
}

Status publish_zero(Bus& bus, std::size_t publisher, bool stamped) {
  constexpr int kTimes = 4;
  constexpr auto kPeriod = std::chrono::milliseconds(20);
  for (int i = 0; i < kTimes; ++i) {
    if (Status status = bus.publish(publisher, velocity_message_now({}, stamped)); !status) return status;
    std::this_thread::sleep_for(kPeriod);
  }
  return {};
}

namespace {

constexpr std::string_view kDone = "done";

/// The child process. Reads "topic type" lines until the pipe ends.
class Guarding {
 public:
  Guarding(Descriptor pipe, BusOptions options) : pipe_(std::move(pipe)), options_(std::move(options)) {}

  /// Reads until the pipe ends; returns whether the parent had reported a regular end.
  bool wait() {
    std::array<char, 512> bytes{};
    std::string rest;
    for (;;) {
      const ssize_t count = ::read(pipe_.number(), bytes.data(), bytes.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return false;
      rest.append(bytes.data(), static_cast<std::size_t>(count));
      for (std::size_t end = rest.find('\n'); end != std::string::npos; end = rest.find('\n')) {
        const std::string line = rest.substr(0, end);
        rest.erase(0, end + 1);
        if (line == kDone) return true;
        take(line);
      }
    }
  }

  /// Publishes zero for as long as discovery of a new publisher may take. Returns the topics.
  std::vector<std::string> publish_zeros() {
    constexpr Duration kMaxDiscovery = std::chrono::seconds(2);
    if (!bus_) return {};
    std::vector<std::pair<std::size_t, bool>> publishers;
    std::vector<std::string> names;
    for (const BusTopic& topic : topics_) {
      const auto name = ros_topic(topic);
      const auto made = bus_->advertise(topic, {.reliable = true, .depth = 1});
      if (!name || !made) continue;
      publishers.emplace_back(*made, name->type == ros2::TwistStamped::kType);
      names.push_back(name->topic);
    }
    const Duration until = steady_now() + kMaxDiscovery;
    while (steady_now() < until)
      for (const auto& [publisher, stamped] : publishers) (void)publish_zero(*bus_, publisher, stamped);
    return names;
  }

 private:
  void take(const std::string& line) {
    const std::size_t space = line.find(' ');
    if (space == std::string::npos) return;
    topics_.push_back({line.substr(0, space), line.substr(space + 1)});
    if (bus_) return;
    auto opened = open_bus(options_);  // opened now, because discovering the robot takes time
    if (opened) bus_ = std::move(*opened);
  }

  Descriptor pipe_;
  BusOptions options_;
  std::unique_ptr<Bus> bus_{};
  std::vector<BusTopic> topics_{};
};

/// Detaches the child from the signals, name and standard streams of its parent.
void detach_from_parent() {
  setpgid(0, 0);  // Ctrl-C in the terminal is meant for the parent only
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);
  std::signal(SIGPIPE, SIG_IGN);
  prctl(PR_SET_NAME, "wm-zero-guard");  // `killall waymark` must not end it
  const Descriptor nothing(::open("/dev/null", O_RDWR | O_CLOEXEC));
  dup2(nothing.number(), STDIN_FILENO);
  dup2(nothing.number(), STDOUT_FILENO);
}

void guard_until_end(Descriptor pipe, BusOptions options,
                     const std::function<void(const std::string&)>& report) {
  Guarding guarding(std::move(pipe), std::move(options));
  if (guarding.wait()) return;
  const std::vector<std::string> topics = guarding.publish_zeros();
  if (!topics.empty())
    report(fmt::format("the program that published commands was killed; published zero on {}",
                       fmt::join(topics, ", ")));
}

}  // namespace

Result<ZeroGuard> ZeroGuard::start(BusOptions options,
                                   const std::function<void(const std::string&)>& report) {
  std::array<int, 2> ends{};
  const auto failed = [] {
    return fail(ErrorCode::LimitExceeded,
                fmt::format("cannot start the process that stops the robot if this one is killed: {}",
                            std::strerror(errno)));
  };
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return failed();
  Descriptor read_end(ends[0]);
  Descriptor write_end(ends[1]);
  const pid_t child = fork();
  if (child < 0) return failed();
  if (child > 0) return ZeroGuard(child, std::move(write_end));
  write_end.close();
  detach_from_parent();
  options.node = "waymark_zero_guard";
  options.self.reset();
  guard_until_end(std::move(read_end), std::move(options), report);
  _exit(0);
}

ZeroGuard::~ZeroGuard() {
  if (!pipe_.open()) return;
  const std::string line = fmt::format("{}\n", kDone);
  (void)!::write(pipe_.number(), line.data(), line.size());
  pipe_.close();
  (void)waitpid(child_, nullptr, 0);
}

void ZeroGuard::guard(const BusTopic& topic) {
  if (!guarded_.insert(topic.topic).second) return;
  const std::string line = fmt::format("{} {}\n", topic.topic, topic.type);
  (void)!::write(pipe_.number(), line.data(), line.size());
}

}  // namespace waymark
