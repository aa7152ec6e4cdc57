// Tests every way in which teaching a lap can end, and its messages, in the robot loop, with a simulated
// robot and clock.
#include "waymark/runtime/teach_session.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/tiny_robot.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// Drives forwards for a while.
class AheadDriver final : public LapDriver {
 public:
  void receive(const Sample& /*sample*/) override { ++received; }
  Result<DriverDecision> drive(Duration uptime, SensorTime now) override {
    times.push_back(uptime);
    if (fails_at && uptime >= *fails_at) return fail(ErrorCode::Unreadable, "the gamepad was unplugged");
    return DriverDecision{.command = {0.3, 0}, .done = uptime >= done_at, .pad = GamepadState{.stamp = now}};
  }

  Duration done_at = seconds(4);
  std::optional<Duration> fails_at{};
  int received = 0;
  std::vector<Duration> times{};
};

TeachSetup tiny_setup() {
  const PinholeRadtan projection{.fx = 400, .fy = 400, .cx = 320, .cy = 240};
  TeachSetup setup{.camera = CameraModel::make(projection, 640, 480).value()};
  setup.sizes.default_size_m = 0.16;
  return setup;
}

/// A session in the robot loop.
struct Drive {
  explicit Drive(const TeachSessionOptions& options = {})
      : session(
            driver, LapMonitor(tiny_setup(), {}, listener()),
            [this](Duration uptime) { return request ? request(uptime) : SessionRequest{}; }, options) {}

  TeachListener listener() {
    return {.on_sample = [this](const Sample& sample) -> Status {
              samples.push_back(sample);
              if (fails_after && samples.size() > *fails_after)
                return fail(ErrorCode::Unwritable, "disk full");
              return {};
            },
            .on_progress = [this](const std::string& line) { progress.push_back(line); },
            .on_message = [this](const std::string& sentence) { words.push_back(sentence); }};
  }
  Result<LapEnd> drive() {
    RobotLoop loop(robot, robot, robot.pacing(), {}, {.timeout_s = 30});
    RobotListener driven = session.listener();
    driven.should_stop = [this] { return stop_at && robot.clock >= *stop_at; };
    const auto end = loop.drive(driven);
    if (!end) return tl::unexpected(end.error());
    return session.end(*end);
  }
  template <class Kind>
  [[nodiscard]] int count() const {
    return static_cast<int>(
        std::ranges::count_if(samples, [](const Sample& s) { return std::holds_alternative<Kind>(s); }));
  }

  test::TinyRobot robot{};
  AheadDriver driver{};
  std::function<SessionRequest(Duration)> request{};
  std::optional<Duration> stop_at{};
  std::optional<std::size_t> fails_after{};
  std::vector<Sample> samples{};
  std::vector<std::string> progress{};
  std::vector<std::string> words{};
  TeachSession session;
};

TEST(TeachSession, EndsWhenTheDriverIsDone) {
  Drive lap;
  const auto end = lap.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished);
  EXPECT_FALSE(end->interrupted);
  EXPECT_NEAR(end->lap_s, 4, 0.1);
  EXPECT_NEAR(lap.robot.x_m(), 4 * 0.3, 0.05);
  EXPECT_EQ(lap.robot.last(), VelocityCommand{});
  EXPECT_GE(lap.driver.received, lap.count<Odometry>() + lap.count<TagFrame>());
  EXPECT_EQ(lap.count<GamepadState>(), static_cast<int>(lap.driver.times.size()))
      << "the gamepad is recorded";
  EXPECT_EQ(lap.count<StampedCommand>(), static_cast<int>(lap.driver.times.size()));
  EXPECT_TRUE(lap.words.empty());
}

TEST(TeachSession, SummarisesTheLap) {
  Drive lap;
  ASSERT_TRUE(lap.drive());
  const TeachSummary summary = lap.session.lap().summary();
  EXPECT_EQ(summary.frames, lap.count<TagFrame>());
  EXPECT_EQ(summary.detections, 2 * summary.frames);
  EXPECT_EQ(summary.seen.size(), 2U);
  EXPECT_NEAR(summary.distance_m, lap.robot.x_m(), 0.05);
  ASSERT_EQ(static_cast<int>(lap.progress.size()), summary.frames);
  EXPECT_THAT(lap.progress.back(), ::testing::HasSubstr("2 tags"));
  testing::expect_on_page("session", lap.progress.back());
}

TEST(TeachSession, CountsTheTimeOfTheLap) {
  std::vector<std::string> lines;
  LapMonitor lap(tiny_setup(), {}, {.on_progress = [&](const std::string& line) { lines.push_back(line); }});
  for (const int second : {90000, 90001, 90012})  // timestamps from a clock that was started with the
                                                  // computer
    ASSERT_TRUE(lap.receive(TagFrame{.stamp = SensorTime(seconds(second))}));
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_TRUE(lines.front().starts_with("0.0 s, ")) << lines.front();
  EXPECT_TRUE(lines.back().starts_with("12.0 s, ")) << lines.back();
}

TEST(TeachSession, WarnsOfAbruptStartsOnTheProgressLineAndInTheSummary) {
  Drive lap;
  ASSERT_TRUE(lap.drive());  // accelerates from standstill to 0.3 m/s between two samples
  EXPECT_GT(lap.session.lap().monitor().abrupt_moments(), 0);
}

TEST(TeachSession, EndsOnRequestWithZero) {
  Drive lap;
  lap.request = [](Duration uptime) { return SessionRequest{.end = uptime >= seconds(2)}; };
  const auto end = lap.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished);
  EXPECT_NEAR(end->lap_s, 2, 0.1);
  EXPECT_EQ(std::get<StampedCommand>(lap.samples.back()).command, VelocityCommand{});
}

TEST(TeachSession, StopsWhileRequested) {
  Drive lap;
  lap.request = [](Duration uptime) {
    return SessionRequest{.command_zero = uptime >= seconds(1) && uptime < seconds(3)};
  };
  ASSERT_TRUE(lap.drive());
  EXPECT_NEAR(lap.robot.x_m(), 2 * 0.3, 0.05) << "it drove for two out of four seconds";
}

TEST(TeachSession, ASignalInterruptsIt) {
  Drive lap;
  lap.stop_at = seconds(1);
  const auto end = lap.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->interrupted);
  EXPECT_FALSE(end->finished);
  EXPECT_EQ(lap.robot.last(), VelocityCommand{});
}

TEST(TeachSession, ReportsEachSilenceOnce) {
  Drive lap({.silence_s = 1});
  lap.driver.done_at = seconds(9);
  lap.robot.camera_silent = {seconds(1), seconds(4)};
  lap.robot.wheels_silent = {seconds(5), seconds(7)};
  ASSERT_TRUE(lap.drive());
  ASSERT_EQ(lap.words.size(), 2U);
  testing::expect_on_page("session", lap.words[0]);
  testing::expect_on_page("session", lap.words[1]);

  Drive twice({.silence_s = 1});
  twice.robot.silent = {milliseconds(500), milliseconds(2000)};
  twice.robot.camera_silent = {milliseconds(2500), milliseconds(3900)};
  ASSERT_TRUE(twice.drive());
  EXPECT_EQ(twice.words.size(), 3U) << "both sensors are reported, and the camera a second time";

  Drive unasked;
  unasked.robot.silent = {seconds(1), seconds(3)};
  ASSERT_TRUE(unasked.drive());
  EXPECT_TRUE(unasked.words.empty());
}

TEST(TeachSession, AnyErrorEndsItWithZeroAndKeepsTheSamples) {
  Drive dead;
  dead.robot.dies_after = seconds(2);
  auto end = dead.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "the robot's process ended");
  EXPECT_EQ(dead.robot.last(), VelocityCommand{});
  EXPECT_GT(dead.session.lap().summary().frames, 30);

  Drive unplugged;
  unplugged.driver.fails_at = seconds(1);
  end = unplugged.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "the gamepad was unplugged");
  EXPECT_EQ(unplugged.robot.last(), VelocityCommand{});

  Drive full;
  full.fails_after = 50;
  end = full.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "disk full");
  EXPECT_EQ(full.robot.last(), VelocityCommand{});
}

TEST(LapMonitor, PassesImagesOnWithoutSearchingThem) {
  int images = 0;
  LapMonitor lap(tiny_setup(), {}, {.on_sample = [&](const Sample& sample) {
                   images += std::holds_alternative<CameraFrame>(sample) ? 1 : 0;
                   return Status();
                 }});
  ASSERT_TRUE(lap.receive(CameraFrame{.image = Image(1, 1)}));
  EXPECT_EQ(images, 1);
  EXPECT_EQ(lap.summary().frames, 0);
}

TEST(MonitorOptions, FollowTheCamera) {
  const TeachMonitorOptions options = monitor_options(tiny_setup().camera, 5);
  EXPECT_NEAR(options.focal_length_px, 400, 0.01);
  EXPECT_EQ(options.exposure_ms, 5);
  EXPECT_EQ(monitor_options(tiny_setup().camera).exposure_ms, TeachMonitorOptions{}.exposure_ms);
}

TEST(TeachSession, ReportsThatAGivenPoseHasNoEffect) {
  Drive run;
  run.request = [](Duration uptime) {
    SessionRequest request;
    if (uptime == milliseconds(1001)) request.pose = GivenPose{};
    if (uptime == milliseconds(1001)) request.messages = {"refused"};
    return request;
  };
  ASSERT_TRUE(run.drive());
  EXPECT_EQ(std::ranges::count(run.words, "refused"), 1);
  const auto message =
      std::ranges::find_if(run.words, [](const std::string& text) { return text != "refused"; });
  ASSERT_NE(message, run.words.end());
  testing::expect_on_page("session", *message);
}

}  // namespace
}  // namespace waymark
