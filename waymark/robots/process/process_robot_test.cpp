#include "waymark/robots/process/process_robot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

const ProcessRobotOptions kHere{.hello_within = seconds(20), .watchdog = WAYMARK_WATCHDOG};
constexpr const char* kHello = R"(echo '{"type":"hello","protocol_version":1,"name":"tiny"}'; )";

std::string error_of(const std::string& command) {
  const auto robot = ProcessRobot::start(command, kHere);
  return robot ? "started" : to_string(robot.error());
}

TEST(ProcessRobot, ReturnsSamplesUntilTheProcessEnds) {
  auto robot = ProcessRobot::start(
      std::string(kHello) + R"(echo '{"type":"wheels","stamp_s":1.5,"left_rad":2,"right_rad":3}'; exit 4)",
      kHere);
  ASSERT_TRUE(robot) << to_string(robot.error());
  EXPECT_EQ((*robot)->hello().name, "tiny");
  EXPECT_FALSE((*robot)->now());
  const auto message = (*robot)->next(seconds(20));
  ASSERT_TRUE(message && *message);
  EXPECT_EQ(std::get<WheelTicks>(std::get<Sample>(**message)).right_rad, 3);
  ASSERT_TRUE((*robot)->now());
  EXPECT_GE((*robot)->now()->time_since_epoch(), milliseconds(1500));
  const auto end = (*robot)->next(seconds(20));
  ASSERT_FALSE(end);
  EXPECT_THAT(to_string(end.error()), HasSubstr("exit code 4"));
  EXPECT_FALSE((*robot)->command({0.1, 0}));
}

TEST(ProcessRobot, TheErrorOfAnEndedProcessContainsItsLastLog) {
  auto robot = ProcessRobot::start(
      std::string(kHello) + R"(echo '{"type":"log","text":"the port is gone. Check the cable."}'; exit 1)",
      kHere);
  ASSERT_TRUE(robot) << to_string(robot.error());
  Result<std::optional<RobotEvent>> end = (*robot)->next(seconds(20));
  for (int i = 0; i < 20 && end; ++i) end = (*robot)->next(seconds(20));
  ASSERT_FALSE(end);
  EXPECT_THAT(end.error().message, HasSubstr("exit code 1"));
  EXPECT_THAT(end.error().message, HasSubstr("the port is gone. Check the cable."));
  testing::expect_on_page("robots", end.error());
}

TEST(ProcessRobot, AnswersTheStepOfARobotInLockstep) {
  // It answers the commands for a step with a log line.
  auto robot = ProcessRobot::start(
      R"(echo '{"type":"hello","protocol_version":1,"name":"tiny","lockstep":true}'
         echo '{"type":"step","stamp_s":7.25,"step":31}'
         while read line; do case "$line" in *step*) echo '{"type":"log","text":"answered 31"}';; esac; done)",
      kHere);
  ASSERT_TRUE(robot) << to_string(robot.error());
  const auto step = (*robot)->next(seconds(20));
  ASSERT_TRUE(step && *step);
  EXPECT_EQ(std::get<CommandRequest>(**step).stamp.time_since_epoch(), milliseconds(7250));
  EXPECT_EQ((*robot)->now()->time_since_epoch(), milliseconds(7250)) << "its time does not advance";
  ASSERT_TRUE((*robot)->command({0.1, 0.2}));
  const auto log = (*robot)->next(seconds(20));
  ASSERT_TRUE(log && *log);
  EXPECT_EQ(std::get<RobotText>(**log).text, "answered 31");
}

TEST(ProcessRobot, SimulatedTimeIsThatOfTheNewestSample) {
  // A simulation that sends nothing more after two samples.
  auto robot = ProcessRobot::start(
      R"(echo '{"type":"hello","protocol_version":1,"name":"tiny","simulated_time":true}'
         echo '{"type":"wheels","stamp_s":7.5,"left_rad":0,"right_rad":0}'
         echo '{"type":"odometry","stamp_s":7.25,"x_m":0,"y_m":0,"yaw_rad":0,"speed_m_s":0,"yaw_rate_rad_s":0}'
         while read line; do :; done)",
      kHere);
  ASSERT_TRUE(robot) << to_string(robot.error());
  for (int i = 0; i < 2; ++i) ASSERT_TRUE((*robot)->next(seconds(20)).value());
  EXPECT_FALSE((*robot)->next(milliseconds(200)).value()) << "there is no third sample";
  EXPECT_EQ((*robot)->now()->time_since_epoch(), milliseconds(7500));
}

TEST(ProcessRobot, DoesNotStartWithoutAHello) {
  EXPECT_THAT(error_of("exit 3"), HasSubstr("exit code 3"));
  EXPECT_THAT(error_of("/no/such/robot 2>/dev/null"), HasSubstr("no such program"));
  EXPECT_THAT(error_of("echo starting motors"), HasSubstr(":1: "));
  EXPECT_THAT(error_of("echo starting motors"), HasSubstr("'starting motors'"));
  EXPECT_THAT(error_of(R"(echo '{"type":"imu","stamp_s":1}')"), HasSubstr("'hello'"));
  const auto silent = ProcessRobot::start("exec 3>&1; exec cat > /dev/null",
                                          {.hello_within = milliseconds(50), .watchdog = WAYMARK_WATCHDOG});
  ASSERT_FALSE(silent);
  EXPECT_THAT(silent.error().message, HasSubstr("0.05 s"));
  testing::expect_on_page("robots", silent.error());
}

TEST(ProcessRobot, StartEndsWhenItShouldStop) {
  std::vector<std::string> notes;
  ProcessRobotOptions options = kHere;
  options.on_waiting = [&](const std::string& text) { notes.push_back(text); };
  options.should_stop = [&] { return !notes.empty(); };
  const auto silent = ProcessRobot::start("exec 3>&1; exec cat > /dev/null", options);
  ASSERT_FALSE(silent);
  testing::expect_on_page("robots", silent.error());
  ASSERT_EQ(notes.size(), 1);
  EXPECT_THAT(notes.front(), HasSubstr("20 s"));
  testing::expect_on_page("robots", notes.front());
}

}  // namespace
}  // namespace waymark
