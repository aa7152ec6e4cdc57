#include "waymark/robots/wire/wire_loop.hpp"

#include <algorithm>
#include <array>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char* kDrives = R"({"type":"hello","protocol_version":1})";
constexpr const char* kListens = R"({"type":"hello","protocol_version":1,"listen_only":true})";
constexpr const char* kFast = R"({"type":"velocity","speed_m_s":0.5,"yaw_rate_rad_s":0})";
constexpr const char* kBye = R"({"type":"bye"})";

/// The ends of a process, and a clock that is advanced only by the robot.
struct FakeWire {
  FakeWire() {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe(ends.data()), 0);
    input = Descriptor(ends[0]);
    orders = Descriptor(ends[1]);
    wire.input = input.number();
  }
  void order(const std::string& line) {
    std::size_t written = 0;
    (void)write_some(orders.number(), line + "\n", written);
  }

  Descriptor input{};
  Descriptor orders{};
  Duration now = seconds(1000);
  bool reads = true;
  std::vector<std::string> lines{};  ///< lines written to the reader
  std::vector<std::string> shown{};  ///< messages for the user
  RobotWire wire{.input = 0,
                 .write =
                     [this](const std::string& line) {
                       lines.push_back(line);
                       return reads;
                     },
                 .note = [this](const std::string& text) { shown.push_back(text); }};
};

/// A robot that starts sending at `sends_after`; each turn takes 50 ms on the fake clock.
class FakeRobot final : public WireLoop {
 public:
  explicit FakeRobot(FakeWire& fake, const WireLoopOptions& options = {})
      : WireLoop(fake.wire, options, [&fake] { return fake.now; }), fake_(fake) {}

  std::function<void(Duration waited)> at_turn = [](Duration) {};
  std::optional<Duration> sends_after{};  ///< time since the beginning; never if empty
  std::function<bool(Duration waited)> speaks = [](Duration) { return true; };
  Status may_command{};
  std::string found = "found nothing";
  bool held = false;
  int checks = 0;
  int helloes = 0;

  [[nodiscard]] std::vector<VelocityCommand> sent() const {
    const std::scoped_lock lock(mutex_);
    return sent_;
  }
  using WireLoop::role;

 private:
  Status poll_robot() override {
    fake_.now += milliseconds(50);
    at_turn(waited());
    if (has_sent() && speaks(waited())) newest_ = fake_.now;
    return {};
  }
  [[nodiscard]] bool has_sent() const { return sends_after && waited() >= *sends_after; }
  Result<bool> ready() override { return has_sent(); }
  Status prepare() override { return may_command; }
  RobotHello hello() const override { return {.name = "fake"}; }
  void after_hello() override { ++helloes; }
  void send(const VelocityCommand& command) override {
    const std::scoped_lock lock(mutex_);
    sent_.push_back(command);
  }
  bool must_hold(Duration /*now*/) const override { return held; }
  std::vector<std::string> silence_reports(Duration now) override {
    return greeted() ? silence_.take_reports(now - newest_, listens()) : std::vector<std::string>();
  }
  Status check() override {
    ++checks;
    return {};
  }
  NoContact no_contact() override {
    return {.report = "report; " + found,
            .gave_up = fail(ErrorCode::NotFound, "gave up; " + found, {.source = "fake"})};
  }

  FakeWire& fake_;
  mutable std::mutex mutex_{};
  std::vector<VelocityCommand> sent_{};
  Duration newest_{};
  SilenceReports silence_{
      milliseconds(200),
      {{.after = milliseconds(200), .text = "silent: zero is sent", .text_listening = "silent"},
       {.after = seconds(2), .text = "is it on?"}}};
};

bool moves(const VelocityCommand& command) { return command.speed_m_s != 0; }

/// Waits in real time, because that is what the sender uses.
void wait_for(const std::function<bool()>& what) {
  for (int i = 0; i < 1000 && !what(); ++i) std::this_thread::sleep_for(milliseconds(5));
  EXPECT_TRUE(what());
}

TEST(WireLoop, ReportsASilentRobotOnceAndGivesUp) {
  FakeWire fake;
  FakeRobot robot(fake);
  fake.order(kFast);
  std::optional<Duration> reported;
  Duration ended{};
  robot.at_turn = [&](Duration waited) {
    if (!fake.shown.empty() && !reported) reported = waited - milliseconds(50);
    ended = waited;
  };
  const Status status = robot.run();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().message, "gave up; found nothing");
  EXPECT_THAT(fake.shown, ElementsAre("report; found nothing"));
  EXPECT_EQ(reported, Duration(seconds(3)));
  EXPECT_EQ(ended, Duration(seconds(12)));
  EXPECT_THAT(fake.lines, IsEmpty());
  EXPECT_THAT(robot.sent(), IsEmpty()) << "nothing is sent to a silent robot";
}

TEST(WireLoop, ReportAgainPrintsAReportWhoseTextChanged) {
  for (const bool again : {false, true}) {
    FakeWire fake;
    FakeRobot robot(fake, {.report_again = again});
    robot.at_turn = [&](Duration waited) {
      if (waited >= seconds(5)) robot.found = "another topic";
    };
    EXPECT_FALSE(robot.run());
    EXPECT_THAT(fake.shown, SizeIs(again ? 2 : 1));
    EXPECT_EQ(fake.shown.back() == "report; another topic", again);
  }
}

TEST(WireLoop, WritesTheHelloOnceAndDoesNotGiveUpAfterIt) {
  FakeWire fake;
  FakeRobot robot(fake);
  robot.sends_after = seconds(4);
  robot.at_turn = [&](Duration waited) {
    EXPECT_EQ(fake.lines.empty(), waited <= seconds(4)) << to_seconds(waited);
    if (waited == seconds(30)) fake.reads = false;
  };
  robot.speaks = [](Duration waited) { return waited < seconds(30); };
  EXPECT_TRUE(robot.run());
  EXPECT_EQ(robot.helloes, 1);
  EXPECT_THAT(fake.lines, ElementsAre(HasSubstr(R"("hello")"), HasSubstr("silent: zero is sent")))
      << "the reader had disconnected by the second line";
}

TEST(WireLoop, ReportsEachSilenceOnceAfterItsTime) {
  FakeWire fake;
  FakeRobot robot(fake);
  robot.sends_after = seconds(1);
  const auto in = [](Duration t, Duration from, Duration to) { return t > from && t <= to; };
  robot.speaks = [&](Duration t) {
    return !in(t, seconds(2), seconds(6)) && !in(t, seconds(8), milliseconds(8500));
  };
  std::vector<Duration> at;
  std::size_t timed = 1;
  robot.at_turn = [&](Duration waited) {
    for (; timed < fake.lines.size(); ++timed) at.push_back(waited - milliseconds(50));
    if (waited == seconds(10)) fake.order(kBye);
    if (waited > seconds(10)) std::this_thread::sleep_for(milliseconds(1));
  };
  EXPECT_TRUE(robot.run());
  EXPECT_THAT(fake.lines, ElementsAre(HasSubstr("hello"), HasSubstr("silent: zero"), HasSubstr("is it on?"),
                                      HasSubstr("silent: zero")));
  EXPECT_THAT(at, ElementsAre(milliseconds(2250), milliseconds(4050), milliseconds(8250)));
}

TEST(WireLoop, SendsCommandsFromTheHelloUntilTheBye) {
  FakeWire fake;
  FakeRobot robot(fake);
  robot.sends_after = seconds(1);
  fake.order(kDrives);
  robot.at_turn = [&](Duration waited) {
    if (waited <= seconds(1)) EXPECT_THAT(robot.sent(), IsEmpty());
    if (waited == milliseconds(1050)) {
      fake.order(kFast);
      wait_for([&] { return std::ranges::any_of(robot.sent(), moves); });
      fake.order(kBye);
    }
    if (waited > seconds(1)) std::this_thread::sleep_for(milliseconds(5));
  };
  EXPECT_TRUE(robot.run());
  const std::vector<VelocityCommand> sent = robot.sent();
  ASSERT_GE(sent.size(), 5U);
  EXPECT_TRUE(std::none_of(sent.end() - 4, sent.end(), moves)) << "four times zero at the end";
  std::this_thread::sleep_for(milliseconds(150));
  EXPECT_THAT(robot.sent(), SizeIs(sent.size())) << "nothing is sent after the end";
}

TEST(WireLoop, SendsZeroToAHeldRobot) {
  FakeWire fake;
  FakeRobot robot(fake);
  robot.sends_after = milliseconds(0);
  robot.held = true;
  fake.order(kDrives);
  robot.at_turn = [&](Duration waited) {
    if (waited == milliseconds(100)) {
      fake.order(kFast);
      wait_for([&] { return robot.sent().size() > 5; });
      fake.order(kBye);
    }
    std::this_thread::sleep_for(milliseconds(2));
  };
  EXPECT_TRUE(robot.run());
  EXPECT_TRUE(std::ranges::none_of(robot.sent(), moves));
}

TEST(WireLoop, CommandsBeforeHelloRepeatsCommandsUntilTheHello) {
  FakeWire fake;
  FakeRobot robot(fake, {.commands_before_hello = true});
  fake.order(kDrives);
  robot.at_turn = [&](Duration waited) {
    EXPECT_EQ(fake.lines.size(), robot.sends_after ? 1U : 0U);
    if (waited == milliseconds(100)) {
      wait_for([&] { return robot.sent().size() > 3; });
      robot.sends_after = waited;
    }
    if (waited == milliseconds(150)) fake.order(kBye);
    std::this_thread::sleep_for(milliseconds(2));
  };
  EXPECT_TRUE(robot.run());
  EXPECT_EQ(robot.helloes, 1);
}

TEST(WireLoop, ListenOnlySendsNothing) {
  FakeWire fake;
  FakeRobot robot(fake);
  robot.sends_after = milliseconds(100);
  fake.order(kListens);
  robot.speaks = [](Duration waited) { return waited <= milliseconds(200); };
  robot.at_turn = [&](Duration waited) {
    if (waited == seconds(1)) {
      std::this_thread::sleep_for(milliseconds(100));
      fake.order(kBye);
    }
    if (waited > seconds(1)) std::this_thread::sleep_for(milliseconds(5));
  };
  EXPECT_TRUE(robot.run());
  EXPECT_EQ(robot.role(), InputRole::Listens);
  EXPECT_THAT(robot.sent(), IsEmpty());
  EXPECT_THAT(fake.lines.at(1), HasSubstr(R"("silent")"));
}

TEST(WireLoop, BeforeTheHelloOnlyAByeEndsIt) {
  for (const bool bye : {false, true}) {
    for (const bool commands : {false, true}) {
      FakeWire fake;
      FakeRobot robot(fake, {.commands_before_hello = commands});
      if (bye) fake.order(kBye);
      fake.orders.close();
      robot.at_turn = [bye](Duration) {
        if (bye) std::this_thread::sleep_for(milliseconds(20));  // gives the sender time to read it
      };
      EXPECT_EQ(static_cast<bool>(robot.run()), bye) << "otherwise it gives up after 12 s";
      EXPECT_EQ(fake.shown.empty(), bye);
    }
  }
}

TEST(WireLoop, AFailedPrepareReplacesTheHello) {
  FakeWire fake;
  FakeRobot robot(fake);
  robot.sends_after = milliseconds(500);
  robot.may_command = fail(ErrorCode::InvalidArgument, "another program commands this robot");
  const Status status = robot.run();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().message, "another program commands this robot");
  EXPECT_THAT(fake.lines, IsEmpty());
  EXPECT_THAT(robot.sent(), IsEmpty());
}

TEST(WireLoop, CallsCheckAtItsPeriod) {
  for (const auto& [every, checks] : {std::pair{Duration(0), 240}, {Duration(seconds(1)), 13}}) {
    FakeWire fake;
    FakeRobot robot(fake, {.check_period = every});
    EXPECT_FALSE(robot.run());
    EXPECT_EQ(robot.checks, checks);
  }
}

}  // namespace
}  // namespace waymark
