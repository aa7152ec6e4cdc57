#include "waymark/robots/watchdog/watched_process.hpp"

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"

// The processes run in real time; the tests check the order of events. The bounds in seconds allow for busy
// computers.
namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

struct ReceivedLine {
  Duration at{};
  std::string line{};

  [[nodiscard]] bool moves() const {
    return line.find("velocity") != std::string::npos && line.find("\"speed_m_s\":0,") == std::string::npos;
  }
  [[nodiscard]] bool stops() const { return line.find("\"stop\"") != std::string::npos; }
  [[nodiscard]] bool bye() const { return line.find("bye") != std::string::npos; }
};

/// A robot that writes every order to a named pipe, where the test adds a timestamp.
class Robot {
 public:
  Robot() {
    std::string name = (std::filesystem::temp_directory_path() / "waymark-wire-XXXXXX").string();
    folder_ = mkdtemp(name.data());
    const std::string fifo = (folder_ / "orders").string();
    EXPECT_EQ(mkfifo(fifo.c_str(), 0600), 0);
    orders_ = Descriptor(::open(fifo.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  }
  ~Robot() { std::filesystem::remove_all(folder_); }
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  /// The other descriptor keeps the pipe to the watchdog open.
  [[nodiscard]] std::string command() const {
    return "exec 3>&1; exec cat > " + (folder_ / "orders").string();
  }
  /// Prints one line, closes its standard output, and continues until its input ends.
  [[nodiscard]] std::string mute_command() const {
    return "echo here; sleep 0.3; exec cat > " + (folder_ / "orders").string();
  }
  [[nodiscard]] std::string slow_command() const {
    return "while read line; do echo \"$line\" > " + (folder_ / "orders").string() + "; sleep 0.1; done";
  }
  /// Reads until `enough` returns true for the newest line; returns false after 20 s.
  template <class Enough>
  bool listen(Enough enough) {
    const Duration deadline = steady_now() + seconds(20);
    while (steady_now() < deadline) {
      pollfd ready{orders_.number(), POLLIN, 0};
      (void)poll(&ready, 1, 20);
      std::string bytes;
      (void)read_some(orders_.number(), bytes);
      lines_.add(bytes);
      while (const auto line = lines_.next()) {
        received_.push_back({steady_now(), line->text});
        if (enough(received_.back())) return true;
      }
    }
    return false;
  }
  [[nodiscard]] const std::vector<ReceivedLine>& received() const { return received_; }

 private:
  std::filesystem::path folder_;
  Descriptor orders_;
  LineSplitter lines_;
  std::vector<ReceivedLine> received_;
};

/// A separate process that keeps driving indefinitely.
pid_t fork_driver(const std::string& command) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  auto robot = WatchedProcess::start(command, WAYMARK_WATCHDOG);
  while (robot && (*robot)->send(0.3, 0.1)) (void)(*robot)->read(milliseconds(20));
  _exit(1);
}

void reap(pid_t pid) {
  int status = 0;
  waitpid(pid, &status, 0);
}

TEST(Watchdog, StopsTheRobotWhenTheDriverIsKilledAtAnyMoment) {
  Random random(20261122);
  Duration worst{};
  for (int i = 0; i < 5; ++i) {
    Robot robot;
    const pid_t driver = fork_driver(robot.command());
    ASSERT_TRUE(robot.listen([](const ReceivedLine& received) { return received.moves(); }));
    const Duration until = steady_now() + milliseconds(static_cast<int>(random.uniform() * 120));
    ASSERT_TRUE(robot.listen([&](const ReceivedLine& received) { return received.at >= until; }));
    const std::size_t before = robot.received().size();
    const Duration killed = steady_now();
    ASSERT_EQ(kill(driver, SIGKILL), 0);
    reap(driver);
    ASSERT_TRUE(robot.listen([](const ReceivedLine& received) { return received.bye(); }))
        << "the robot is notified that it ends";
    bool stopped = false;
    int zeros = 0;
    for (std::size_t k = before; k < robot.received().size(); ++k) {
      const ReceivedLine& received = robot.received()[k];
      if (received.stops() && !stopped) worst = std::max(worst, received.at - killed);
      stopped = stopped || received.stops();
      zeros += received.stops() ? 1 : 0;
      EXPECT_FALSE(stopped && received.moves()) << received.line;
    }
    EXPECT_GE(zeros, 3) << "zero is repeated";
  }
  RecordProperty("worst_ms", static_cast<int>(worst.count() / 1'000'000));
  EXPECT_LT(worst, seconds(2));
}

TEST(Watchdog, StopsTheRobotWhileTheDriverIsFrozen) {
  Robot robot;
  const pid_t driver = fork_driver(robot.command());
  ASSERT_TRUE(robot.listen([](const ReceivedLine& received) { return received.moves(); }));
  ASSERT_EQ(kill(driver, SIGSTOP), 0);
  ASSERT_TRUE(robot.listen([](const ReceivedLine& received) { return received.stops(); }));
  EXPECT_NE(robot.received().back().line.find("no fresh command"), std::string::npos);
  const std::size_t at = robot.received().size();
  const Duration until = steady_now() + milliseconds(200);
  ASSERT_TRUE(robot.listen([&](const ReceivedLine& received) { return received.at > until; }));
  for (std::size_t k = at; k < robot.received().size(); ++k) EXPECT_TRUE(robot.received()[k].stops());
  ASSERT_EQ(kill(driver, SIGCONT), 0);
  EXPECT_TRUE(robot.listen([](const ReceivedLine& received) { return received.moves(); }));
  kill(driver, SIGKILL);
  reap(driver);
  EXPECT_TRUE(robot.listen([](const ReceivedLine& received) { return received.bye(); }));
}

TEST(Watchdog, ListenOnlySendsNoVelocity) {
  Robot robot;
  RobotCommand command(robot.command());
  command.listen_only = true;
  {
    auto wire = WatchedProcess::start(command, WAYMARK_WATCHDOG);
    ASSERT_TRUE(wire) << to_string(wire.error());
    ASSERT_TRUE((*wire)->send(0.3, 0.1)) << "by mistake";
    const Duration until = steady_now() + milliseconds(400);
    while (steady_now() < until) (void)(*wire)->read(milliseconds(50));
  }
  ASSERT_TRUE(robot.listen([](const ReceivedLine& received) { return received.bye(); }));
  ASSERT_EQ(robot.received().size(), 2U);
  EXPECT_NE(robot.received().front().line.find("\"listen_only\":true"), std::string::npos);
}

TEST(Watchdog, SendsZeroBeforeTheFirstCommandAndAfterTheLast) {
  Robot robot;
  auto wire = WatchedProcess::start(robot.command(), WAYMARK_WATCHDOG);
  ASSERT_TRUE(wire) << to_string(wire.error());
  ASSERT_TRUE(robot.listen([](const ReceivedLine& received) { return received.stops(); }));
  EXPECT_NE(robot.received().front().line.find("hello"), std::string::npos);
  EXPECT_NE(robot.received().back().line.find("no command yet"), std::string::npos);
  ASSERT_TRUE((*wire)->send(0.3, 0, 17));
  ASSERT_TRUE(robot.listen([](const ReceivedLine& received) { return received.moves(); }));
  EXPECT_NE(robot.received().back().line.find("\"step\":17"), std::string::npos);
  ASSERT_TRUE(robot.listen([](const ReceivedLine& received) { return received.stops(); })) << "0.25 s later";
  EXPECT_EQ((*wire)->close(), 0) << "cat ends when its input does";
  ASSERT_TRUE(robot.listen([](const ReceivedLine& received) { return received.bye(); }));
  EXPECT_FALSE((*wire)->send(0.3, 0)) << "the process has been closed";
}

TEST(Watchdog, ReportsHowTheRobotsProcessEnded) {
  for (const auto& [command, ending] :
       std::vector<std::pair<std::string, std::string>>{{"echo last line; exit 3", "exit code 3"},
                                                        {"echo last line; kill -9 $$", "signal 9"},
                                                        {"echo last line; exit 0", "exit code 0"}}) {
    auto wire = WatchedProcess::start(command, WAYMARK_WATCHDOG);
    ASSERT_TRUE(wire);
    std::string output;
    Result<std::vector<Line>> lines;
    for (int i = 0; i < 20 && (lines = (*wire)->read(seconds(1))); ++i)
      for (const Line& line : *lines) output += line.text;
    EXPECT_EQ(output, "last line") << command;
    ASSERT_FALSE(lines);
    EXPECT_NE(to_string(lines.error()).find(ending), std::string::npos) << to_string(lines.error());
    testing::expect_on_page("robots", lines.error());
  }
  auto wire = WatchedProcess::start("/no/such/program 2>/dev/null", WAYMARK_WATCHDOG);
  ASSERT_TRUE(wire);
  const auto lines = (*wire)->read(seconds(20));
  ASSERT_FALSE(lines);
  EXPECT_EQ(lines.error().code, ErrorCode::NotFound);
  testing::expect_on_page("robots", lines.error());
  EXPECT_FALSE(WatchedProcess::start("true", "/no/such/watchdog"));
}

TEST(Watchdog, ArgumentsOfAProgramBypassTheShell) {
  const std::string hostile = "a 'b' \"c\" $(exit 7) `exit 8` ; exit 9 \\ *";
  auto wire = WatchedProcess::start(RobotCommand(std::vector<std::string>{"/bin/echo", hostile, ""}),
                                    WAYMARK_WATCHDOG);
  ASSERT_TRUE(wire);
  std::string output;
  Result<std::vector<Line>> lines;
  for (int i = 0; i < 20 && (lines = (*wire)->read(seconds(1))); ++i)
    for (const Line& line : *lines) output += line.text;
  EXPECT_EQ(output, hostile + " ");
  ASSERT_FALSE(lines);
  EXPECT_NE(to_string(lines.error()).find("exit code 0"), std::string::npos) << to_string(lines.error());
  auto nothing =
      WatchedProcess::start(RobotCommand(std::vector<std::string>{"/no/such/program"}), WAYMARK_WATCHDOG);
  ASSERT_TRUE(nothing);
  EXPECT_FALSE((*nothing)->read(seconds(20)));
}

TEST(Watchdog, StopsARobotThatClosesItsStandardOutput) {
  Robot robot;
  auto wire = WatchedProcess::start(robot.mute_command(), WAYMARK_WATCHDOG);
  ASSERT_TRUE(wire);
  Result<std::vector<Line>> lines;
  const Duration began = steady_now();
  while ((lines = (*wire)->read(milliseconds(10))) && steady_now() - began < seconds(20))
    ASSERT_TRUE((*wire)->send(0.3, 0.1));
  ASSERT_FALSE(lines) << "the driver is notified";
  testing::expect_on_page("robots", lines.error());
  ASSERT_TRUE(robot.listen([](const ReceivedLine& received) { return received.bye(); }));
  // Only a command in flight when its output ended may still move it.
  int moves = 0;
  for (const ReceivedLine& received : robot.received()) moves += received.moves() ? 1 : 0;
  EXPECT_LE(moves, 1);
  EXPECT_TRUE(robot.received()[robot.received().size() - 2].stops());
}

TEST(Watchdog, AKilledWatchdogIsReportedInsteadOfTheRobot) {
  Robot robot;
  auto wire = WatchedProcess::start(robot.command(), WAYMARK_WATCHDOG);
  ASSERT_TRUE(wire);
  ASSERT_TRUE(robot.listen([](const ReceivedLine& received) { return received.stops(); }));
  ASSERT_EQ(kill((*wire)->watchdog_pid(), SIGKILL), 0);
  const auto lines = (*wire)->read(seconds(20));
  ASSERT_FALSE(lines);
  EXPECT_NE(lines.error().message.find("watchdog"), std::string::npos) << lines.error().message;
  EXPECT_NE(lines.error().message.find("signal 9"), std::string::npos) << lines.error().message;
  testing::expect_on_page("robots", lines.error());
}

TEST(Watchdog, DoesNotBlockOnARobotThatDoesNotReadAndEndsIt) {
  auto wire = WatchedProcess::start("exec sleep 1000", WAYMARK_WATCHDOG);
  ASSERT_TRUE(wire);
  const Duration start = steady_now();
  for (int i = 0; i < 20000; ++i) ASSERT_TRUE((*wire)->send(0.3, 0.1));
  EXPECT_LT(steady_now() - start, seconds(10));
  EXPECT_EQ((*wire)->close(), 128 + SIGTERM);
}

TEST(Watchdog, AFloodOfUnreadLinesDoesNotBlock) {
  auto wire = WatchedProcess::start("exec yes 2>/dev/null", WAYMARK_WATCHDOG);
  ASSERT_TRUE(wire);
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE((*wire)->send(0.3, 0.1));
    (void)poll(nullptr, 0, 10);
  }
  const auto lines = (*wire)->read(seconds(10));
  ASSERT_TRUE(lines);
  EXPECT_EQ(lines->front().text, "y");
  EXPECT_GT((*wire)->close(), 128) << "killed, or ended by SIGPIPE";
}

TEST(Watchdog, ASlowRobotGetsNoQueueOfOldOrders) {
  Robot robot;
  auto wire = WatchedProcess::start(robot.slow_command(), WAYMARK_WATCHDOG);
  ASSERT_TRUE(wire);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE((*wire)->send(0.3, 0.1));
    (void)poll(nullptr, 0, 10);
  }
  const Duration last = steady_now();
  ASSERT_TRUE(
      robot.listen([&](const ReceivedLine& received) { return received.stops() && received.at > last; }));
  int moves = 0;
  int late = 0;
  for (const ReceivedLine& received : robot.received()) {
    moves += received.moves() ? 1 : 0;
    late += received.moves() && received.line.find("\"sequence\":100,") != std::string::npos ? 1 : 0;
  }
  EXPECT_LE(moves, 60) << "most orders were replaced by newer ones";
  EXPECT_LE(late, 1);
}

TEST(WatchdogProgram, HelpSucceedsOnStandardOutput) {
  const std::string command = "'" WAYMARK_WATCHDOG "' --help";
  std::FILE* out = popen(command.c_str(), "r");
  ASSERT_NE(out, nullptr);
  std::array<char, 200> line{};
  EXPECT_NE(std::fgets(line.data(), line.size(), out), nullptr);
  while (std::fgetc(out) != EOF) {
  }
  EXPECT_EQ(pclose(out), 0);
  EXPECT_EQ(std::string(line.data()).find("usage: waymark-watchdog"), 0U) << line.data();
}

}  // namespace
}  // namespace waymark
