// Tests the loop with a scripted robot and clock: the order of events, the commands sent, and every way in
// which it can end.
#include "waymark/runtime/robot_loop.hpp"

#include <cmath>
#include <deque>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

SensorTime at(Duration since) { return SensorTime(since); }

/// A robot that sends scripted events at given times. Waiting for it advances the clock.
class FakeRobot final : public Source, public Robot {
 public:
  void schedule(Duration when, RobotEvent event) { script_.push_back({when, std::move(event)}); }

  Result<std::optional<RobotEvent>> next(Duration most) override {
    waited_.push_back(most);
    if (script_.empty() && ends) return fail(ErrorCode::Unreadable, "the robot's process ended");
    if (script_.empty() || script_.front().first > clock + most) {
      clock += most;
      return std::optional<RobotEvent>();
    }
    clock = std::max(clock, script_.front().first);
    RobotEvent event = std::move(script_.front().second);
    script_.pop_front();
    received_ = true;
    return std::optional<RobotEvent>(std::move(event));
  }
  bool more() const override { return !script_.empty() && script_.front().first <= clock; }
  std::optional<SensorTime> now() const override {
    return received_ ? std::optional(SensorTime(clock)) : std::nullopt;
  }
  Status command(const VelocityCommand& command) override {
    commands.push_back(command);
    if (deaf) return fail(ErrorCode::Unwritable, "the robot does not listen");
    return {};
  }
  Pacing pacing(bool lockstep) {
    return {.clock = [this] { return clock; }, .lockstep = lockstep};
  }
  [[nodiscard]] const std::vector<Duration>& waited() const { return waited_; }

  Duration clock{};
  bool ends = false;  ///< whether the robot ends after its last event
  bool deaf = false;
  std::vector<VelocityCommand> commands{};

 private:
  std::deque<std::pair<Duration, RobotEvent>> script_{};
  std::vector<Duration> waited_{};
  bool received_ = false;
};

/// Finds one tag in each image; its ID is the value of the first pixel.
class FakeFinder final : public Detector {
 public:
  using Detector::detect;
  Result<std::vector<TagDetection>> detect(const ImageView& image) const override {
    if (image.row(0)[0] == 255) return fail(ErrorCode::Unreadable, "no image");
    return std::vector<TagDetection>{{.tag = {FamilyId::Tag36h11, image.row(0)[0]}}};
  }
};

CameraFrame frame_at(Duration when, std::uint8_t number, const std::string& camera = "cam") {
  CameraFrame frame{.stamp = at(when), .camera = camera, .image = Image(1, 1)};
  frame.image.row(0)[0] = number;
  return frame;
}

/// Drives forwards and keeps everything it receives.
struct Driver {
  RobotListener listener() {
    RobotListener listener;
    listener.on_sample = [this](const Sample& sample) {
      samples.push_back(sample);
      return fails_at != 0 && samples.size() >= fails_at ? Status(fail(ErrorCode::Unwritable, "disk full"))
                                                         : Status();
    };
    listener.decide = [this](Duration uptime, SensorTime now) -> Result<DriverDecision> {
      uptimes.push_back(uptime);
      nows.push_back(now);
      const bool over = uptimes.size() >= decisions;
      return DriverDecision{.command = over && ends_with_zero ? VelocityCommand{} : VelocityCommand{0.3, 0},
                            .done = over};
    };
    listener.on_text = [this](const std::string& text) { texts.push_back(text); };
    listener.should_stop = [this] { return stop_after != 0 && samples.size() >= stop_after; };
    return listener;
  }
  template <class Kind>
  [[nodiscard]] std::vector<Kind> all() const {
    std::vector<Kind> found;
    for (const Sample& sample : samples) {
      if (const auto* kind = std::get_if<Kind>(&sample)) found.push_back(*kind);
    }
    return found;
  }

  std::size_t decisions = 5;
  bool ends_with_zero = true;
  std::size_t fails_at = 0;
  std::size_t stop_after = 0;
  std::vector<Sample> samples{};
  std::vector<Duration> uptimes{};
  std::vector<SensorTime> nows{};
  std::vector<std::string> texts{};
};

TEST(RobotLoop, SkipsImagesOlderThanTheNewest) {
  FakeRobot robot;
  const TagFinder finder{.detector = std::make_unique<FakeFinder>()};
  const auto schedule = [&](int ms, int stamp_ms, const std::string& camera) {
    robot.schedule(milliseconds(ms), Sample(frame_at(milliseconds(stamp_ms), 1, camera)));
  };
  schedule(100, 90, "left");
  schedule(200, 80, "left");   // older than the previous frame
  schedule(300, 85, "right");  // each camera is ordered separately
  schedule(400, 190, "left");
  schedule(9000, 8990, "left");
  schedule(9100, 100, "left");  // a clock jump is passed on
  Driver driver{.decisions = 200};
  RobotLoop loop(robot, robot, robot.pacing(false), {.finder = &finder});
  ASSERT_TRUE(loop.drive(driver.listener()));
  std::vector<SensorTime> stamps;
  for (const TagFrame& frame : driver.all<TagFrame>()) stamps.push_back(frame.stamp);
  const std::vector<SensorTime> expected = {at(milliseconds(90)), at(milliseconds(85)), at(milliseconds(190)),
                                            at(milliseconds(8990)), at(milliseconds(100))};
  EXPECT_EQ(stamps, expected);
  ASSERT_EQ(driver.texts.size(), 1U);
  EXPECT_THAT(driver.texts.front(),
              ::testing::AllOf(::testing::HasSubstr("'left'"), ::testing::HasSubstr("0.010 s")));
  testing::expect_on_page("robots", driver.texts.front());
}

TEST(RobotLoop, DecidesAt20HzFromTheFirstSample) {
  FakeRobot robot;
  robot.clock = seconds(1000);
  robot.schedule(seconds(1000) + milliseconds(120), Sample(Odometry{.stamp = at(seconds(7))}));
  Driver driver;
  const auto end = RobotLoop(robot, robot, robot.pacing(false)).drive(driver.listener());
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->done);
  EXPECT_FALSE(end->interrupted);
  ASSERT_EQ(driver.uptimes.size(), 5U);
  EXPECT_GE(driver.uptimes.front(), milliseconds(120)) << "no command before the first sample";
  for (std::size_t i = 1; i < driver.uptimes.size(); ++i)
    EXPECT_EQ(driver.uptimes[i] - driver.uptimes[i - 1], milliseconds(50));
  EXPECT_EQ(driver.all<StampedCommand>().size(), robot.commands.size());
  EXPECT_EQ(robot.commands.back(), VelocityCommand{});
}

TEST(RobotLoop, PassesSamplesInOrderAndMessagesOfTheRobot) {
  FakeRobot robot;
  robot.schedule(milliseconds(1), Sample(Odometry{.stamp = at(milliseconds(1))}));
  robot.schedule(milliseconds(2), RobotText{"battery low"});
  robot.schedule(milliseconds(3), Sample(ImuSample{.stamp = at(milliseconds(3))}));
  Driver driver{.decisions = 3};
  ASSERT_TRUE(RobotLoop(robot, robot, robot.pacing(false)).drive(driver.listener()));
  EXPECT_EQ(driver.texts, std::vector<std::string>{"battery low"});
  ASSERT_EQ(driver.all<Odometry>().size(), 1U);
  ASSERT_EQ(driver.all<ImuSample>().size(), 1U);
  EXPECT_TRUE(std::holds_alternative<Odometry>(driver.samples.front()));
}

TEST(RobotLoop, RecordsTheCommandsThatARobotReports) {
  FakeRobot robot;
  robot.schedule(milliseconds(1), Sample(StampedCommand{at(milliseconds(1)), {0.2, -0.5}}));
  robot.schedule(milliseconds(60), Sample(StampedCommand{at(milliseconds(60)), {0.2, 0.5}}));
  Driver driver{.decisions = 4};
  ASSERT_TRUE(RobotLoop(robot, robot, robot.pacing(false)).drive(driver.listener()));
  const auto recorded = driver.all<StampedCommand>();
  ASSERT_EQ(recorded.size(), 2U) << "without those that were sent";
  EXPECT_EQ(recorded[0].command, (VelocityCommand{0.2, -0.5}));
  EXPECT_EQ(recorded[1].command, (VelocityCommand{0.2, 0.5}));
  EXPECT_EQ(robot.commands.size(), 4U) << "commands are still sent";
}

TEST(RobotLoop, SearchesOnlyTheNewestImagePerCameraInRealTime) {
  FakeRobot robot;
  robot.schedule(milliseconds(1), Sample(frame_at(milliseconds(1), 1)));
  robot.schedule(milliseconds(1), Sample(frame_at(milliseconds(1), 10, "rear")));
  robot.schedule(milliseconds(1), Sample(frame_at(milliseconds(1), 2)));
  robot.schedule(milliseconds(1), Sample(frame_at(milliseconds(1), 3)));
  Driver driver{.decisions = 4};
  const TagFinder finder{.detector = std::make_unique<FakeFinder>()};
  RobotLoop loop(robot, robot, robot.pacing(false), {.finder = &finder});
  ASSERT_TRUE(loop.drive(driver.listener()));
  EXPECT_EQ(loop.dropped_images(), 2);
  const auto found = driver.all<TagFrame>();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].detections.at(0).tag.number, 3);
  EXPECT_EQ(found[0].camera, "cam");
  EXPECT_EQ(found[1].detections.at(0).tag.number, 10);
  EXPECT_EQ(found[1].camera, "rear");
  EXPECT_EQ(driver.all<CameraFrame>().size(), 2U) << "dropped images are not recorded";
}

TEST(RobotLoop, ReportsExpectedTagsThatWereNotFound) {
  FakeRobot robot;
  for (const int ms : {10, 60, 110}) {
    CameraFrame frame = frame_at(milliseconds(ms), 1);
    frame.image = Image(64, 64, 1);
    robot.schedule(milliseconds(ms), Sample(std::move(frame)));
  }
  const TagFinder finder{.detector = std::make_unique<FakeFinder>()};
  const CameraModel lens =
      CameraModel::make(PinholeRadtan{.fx = 50, .fy = 50, .cx = 32, .cy = 32}, 64, 64).value();
  Driver driver{.decisions = 6};
  RobotListener listener = driver.listener();
  listener.expected = [](const MountedCamera& camera, SensorTime stamp) {
    EXPECT_EQ(camera.name, "cam");
    if (stamp == at(milliseconds(10))) return std::vector<ExpectedTag>();  // there is no estimate yet
    return std::vector<ExpectedTag>{{{FamilyId::Tag36h11, 8}, {{{10, 10}, {40, 10}, {40, 40}, {10, 40}}}}};
  };
  std::vector<MissedTag> missed;
  listener.on_missed = [&](const std::vector<MissedTag>& some) {
    missed.insert(missed.end(), some.begin(), some.end());
  };
  RobotLoop loop(robot, robot, robot.pacing(false),
                 {.finder = &finder, .cameras = {{.name = "cam", .camera = lens}}});
  ASSERT_TRUE(loop.drive(listener));
  ASSERT_EQ(missed.size(), 2U);
  EXPECT_EQ(missed[0].expected.tag.number, 8);
  EXPECT_EQ(missed[0].why, MissReason::TooFaint) << "the image is uniform";
}

TEST(RobotLoop, DecidesImmediatelyAfterAnImage) {
  FakeRobot robot;
  robot.schedule(milliseconds(0), Sample(Odometry{}));
  robot.schedule(milliseconds(20), Sample(frame_at(milliseconds(20), 1)));
  Driver driver{.decisions = 3};
  const TagFinder finder{.detector = std::make_unique<FakeFinder>()};
  ASSERT_TRUE(RobotLoop(robot, robot, robot.pacing(false), {.finder = &finder}).drive(driver.listener()));
  ASSERT_EQ(driver.uptimes.size(), 3U);
  EXPECT_EQ(driver.uptimes[1], milliseconds(20));
  EXPECT_EQ(driver.uptimes[2], milliseconds(70));
}

TEST(RobotLoop, SearchesEveryImageInLockstepAndDecidesOnRequest) {
  FakeRobot robot;
  for (int i = 1; i <= 3; ++i) {
    const Duration now = milliseconds(50 * i);
    robot.schedule(now, Sample(frame_at(now, static_cast<std::uint8_t>(2 * i - 1))));
    robot.schedule(now, Sample(frame_at(now, static_cast<std::uint8_t>(2 * i))));
    robot.schedule(now, CommandRequest{at(now)});
  }
  Driver driver{.decisions = 3};
  const TagFinder finder{.detector = std::make_unique<FakeFinder>()};
  RobotLoop loop(robot, robot, robot.pacing(true), {.finder = &finder});
  const auto end = loop.drive(driver.listener());
  ASSERT_TRUE(end && end->done);
  EXPECT_EQ(loop.dropped_images(), 0);
  EXPECT_EQ(driver.all<TagFrame>().size(), 6U);
  EXPECT_EQ(driver.uptimes, (std::vector<Duration>{milliseconds(50), milliseconds(100), milliseconds(150)}));
  EXPECT_EQ(robot.commands.size(), 3U) << "one response per request";
}

TEST(RobotLoop, ResendsALostAnswerInLockstepAndRecordsItOnce) {
  FakeRobot robot;
  robot.schedule(milliseconds(10), CommandRequest{at(milliseconds(10))});
  robot.schedule(milliseconds(350), CommandRequest{at(milliseconds(10))});  // sent again because the response
                                                                            // was lost
  Driver driver{.decisions = 2};
  ASSERT_TRUE(RobotLoop(robot, robot, robot.pacing(true)).drive(driver.listener()));
  ASSERT_EQ(robot.commands.size(), 5U) << "the response, three repetitions, the final zero";
  EXPECT_EQ(robot.commands[1], robot.commands[0]);
  EXPECT_EQ(robot.commands[3], robot.commands[0]);
  EXPECT_EQ(driver.all<StampedCommand>().size(), 2U);
}

TEST(RobotLoop, DecidesForASilentRobot) {
  FakeRobot robot;
  robot.schedule(milliseconds(0), Sample(Odometry{}));
  Driver driver{.decisions = 100};
  const auto end = RobotLoop(robot, robot, robot.pacing(false)).drive(driver.listener());
  ASSERT_TRUE(end && end->done);
  EXPECT_GE(end->uptime, milliseconds(99 * 50)) << "decisions continue during the silence";
  for (const Duration most : robot.waited()) EXPECT_LE(most, milliseconds(50));
}

TEST(RobotLoop, ARobotWithoutSamplesIsAnError) {
  FakeRobot robot;
  Driver driver{.decisions = 1000};
  const auto end = RobotLoop(robot, robot, robot.pacing(false)).drive(driver.listener());
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::NotFound);
  testing::expect_on_page("robots", end.error());
  EXPECT_EQ(robot.commands.back(), VelocityCommand{});
}

TEST(RobotLoop, EveryEndSendsZero) {
  for (const bool lockstep : {false, true}) {
    FakeRobot robot;
    for (int i = 0; i < 200; ++i) {
      robot.schedule(milliseconds(10 * i), Sample(Odometry{.stamp = at(milliseconds(10 * i))}));
      if (lockstep) robot.schedule(milliseconds(10 * i), CommandRequest{at(milliseconds(10 * i))});
    }
    Driver stopped{.decisions = 1000, .stop_after = 20};
    const auto end = RobotLoop(robot, robot, robot.pacing(lockstep)).drive(stopped.listener());
    ASSERT_TRUE(end);
    EXPECT_TRUE(end->interrupted);
    EXPECT_FALSE(end->done);
    EXPECT_EQ(robot.commands.back(), VelocityCommand{});
    EXPECT_EQ(stopped.all<StampedCommand>().back().command, VelocityCommand{}) << "it is recorded as well";

    Driver slow{.decisions = 1000};
    const auto late =
        RobotLoop(robot, robot, robot.pacing(lockstep), {}, {.timeout_s = 1}).drive(slow.listener());
    ASSERT_TRUE(late);
    EXPECT_TRUE(late->timed_out);
    EXPECT_EQ(robot.commands.back(), VelocityCommand{});

    Driver moving{.decisions = 2, .ends_with_zero = false};  // the last command is not zero
    robot.schedule(seconds(3), Sample(Odometry{}));
    for (int i = 0; i < 5; ++i) robot.schedule(seconds(3), CommandRequest{});
    ASSERT_TRUE(RobotLoop(robot, robot, robot.pacing(lockstep)).drive(moving.listener()));
    EXPECT_EQ(robot.commands.back(), VelocityCommand{});
  }
}

TEST(RobotLoop, AnyErrorIsReturnedAndStopsTheRobot) {
  const auto drive = [](FakeRobot& robot, Driver driver) {
    robot.schedule(milliseconds(0), Sample(Odometry{}));
    robot.schedule(milliseconds(300), Sample(frame_at(milliseconds(300), 255)));
    const TagFinder finder{.detector = std::make_unique<FakeFinder>()};
    const auto end =
        RobotLoop(robot, robot, robot.pacing(false), {.finder = &finder}).drive(driver.listener());
    EXPECT_EQ(robot.commands.back(), VelocityCommand{});
    return end ? std::string("no error") : end.error().message;
  };
  FakeRobot gone;
  gone.schedule(milliseconds(0), Sample(Odometry{}));
  gone.ends = true;
  Driver driver{.decisions = 1000};
  const auto end = RobotLoop(gone, gone, gone.pacing(false)).drive(driver.listener());
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "the robot's process ended");
  EXPECT_EQ(gone.commands.back(), VelocityCommand{});
  FakeRobot full;
  EXPECT_EQ(drive(full, {.decisions = 1000, .fails_at = 3}), "disk full");
  FakeRobot deaf;
  deaf.deaf = true;
  EXPECT_EQ(drive(deaf, {.decisions = 1000}), "the robot does not listen");
}

TEST(RobotLoop, SkipsAndReportsAnUnreadableImage) {
  FakeRobot robot;
  robot.schedule(milliseconds(0), Sample(Odometry{}));
  robot.schedule(milliseconds(20), Sample(frame_at(milliseconds(20), 255)));
  robot.schedule(milliseconds(60), Sample(frame_at(milliseconds(60), 7)));
  Driver driver{.decisions = 10};
  const TagFinder finder{.detector = std::make_unique<FakeFinder>()};
  ASSERT_TRUE(RobotLoop(robot, robot, robot.pacing(false), {.finder = &finder}).drive(driver.listener()));
  EXPECT_EQ(driver.all<CameraFrame>().size(), 2U);
  EXPECT_EQ(driver.all<TagFrame>().size(), 1U);
  ASSERT_EQ(driver.texts.size(), 1U);
  testing::expect_on_page("robots", driver.texts[0]);
}

TEST(RobotLoop, RecordsTheGamepadBeforeItsCommand) {
  FakeRobot robot;
  robot.schedule(milliseconds(0), Sample(Odometry{}));
  Driver driver{.decisions = 2};
  RobotListener listener = driver.listener();
  listener.decide = [inner = listener.decide](Duration uptime, SensorTime now) {
    auto decision = inner(uptime, now);
    decision->pad = GamepadState{.stamp = now};
    return decision;
  };
  ASSERT_TRUE(RobotLoop(robot, robot, robot.pacing(false)).drive(listener));
  ASSERT_EQ(driver.all<GamepadState>().size(), 2U);
  EXPECT_TRUE(std::holds_alternative<GamepadState>(driver.samples[1]));
  EXPECT_TRUE(std::holds_alternative<StampedCommand>(driver.samples[2]));
}

TEST(RobotLoop, ListenOnlySendsNothing) {
  for (const bool lockstep : {false, true}) {
    FakeRobot robot;
    for (int i = 1; i <= 20; ++i) {
      robot.schedule(milliseconds(50 * i), Sample(Odometry{.stamp = at(milliseconds(50 * i))}));
      robot.schedule(milliseconds(50 * i), CommandRequest{at(milliseconds(50 * i))});
    }
    robot.ends = true;
    Driver driver;
    driver.decisions = lockstep ? 1000 : 5;  // in lockstep, the robot's process ends first
    RobotLoop loop(robot, robot, robot.pacing(lockstep), {}, {.listen_only = true});
    EXPECT_EQ(loop.drive(driver.listener()).has_value(), !lockstep);
    EXPECT_GE(driver.uptimes.size(), 5U) << "decide() is still called";
    EXPECT_TRUE(robot.commands.empty());
    EXPECT_TRUE(driver.all<StampedCommand>().empty());
  }
}

}  // namespace
}  // namespace waymark
