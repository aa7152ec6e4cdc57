// Tests every way in which a replay can end, in the robot loop, with a simulated robot and clock.
#include "waymark/runtime/replay_session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/tiny_robot.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

/// A session in the robot loop, with the robot at a given position.
struct Drive {
  explicit Drive(const SE2& start = {}, bool lost = false)
      : robot(start),
        replayer(test::tiny_replayer(lost)),
        session(replayer, listener(), options(),
                [this](Duration uptime) { return request ? request(uptime) : SessionRequest{}; }) {}

  Result<ReplayEnd> drive(double timeout_s = 60) {
    RobotLoop loop(robot, robot, lockstep_time([this] { return robot.clock; }), {}, {.timeout_s = timeout_s});
    RobotListener driver = session.listener();
    driver.should_stop = [this] { return stop_at && robot.clock >= *stop_at; };
    driver.decide = [this, inner = driver.decide](Duration uptime, SensorTime now) {
      if (before) before(uptime);
      return inner(uptime, now);
    };
    const auto driven = loop.drive(driver);
    if (!driven) return tl::unexpected(driven.error());
    return session.end(*driven);
  }
  ReplayListener listener() {
    return {.on_sample =
                [this](const Sample&) {
                  ++samples;
                  return Status();
                },
            .on_step = [this](SensorTime now, const ReplayStep& step) -> Status {
              states.push_back(step.state);
              if (fails_at_s && to_seconds(now.time_since_epoch()) > *fails_at_s)
                return fail(ErrorCode::Unwritable, "disk full");
              return {};
            }};
  }
  static ReplaySessionOptions options() { return {.give_up_s = 2}; }

  test::TinyRobot robot;
  Replayer replayer;
  ReplaySession session;
  std::function<void(Duration)> before{};
  std::function<SessionRequest(Duration)> request{};
  std::optional<Duration> stop_at{};
  std::optional<double> fails_at_s{};
  int samples = 0;
  std::vector<ReplayState> states{};
};

TEST(ReplaySession, EndsAtTheGoal) {
  Drive run;
  const auto end = run.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished);
  EXPECT_EQ(end->state, ReplayState::Finished);
  EXPECT_FALSE(end->given_up || end->interrupted || end->timed_out);
  EXPECT_NEAR(run.robot.x_m(), 2, 0.1);
  EXPECT_NEAR(end->driven_m, 2, 0.1);
  EXPECT_EQ(run.robot.last(), VelocityCommand{});
  EXPECT_GT(end->frames, 20);
  EXPECT_EQ(end->frames_with_two_tags, end->frames);
  EXPECT_EQ(end->stops, 0);
  EXPECT_NEAR(end->lap_s, to_seconds(run.robot.clock), 0.1);
  EXPECT_EQ(run.states.back(), ReplayState::Finished);
  EXPECT_GT(run.samples, 3 * end->frames - 3) << "odometry, tags and commands";
}

TEST(ReplaySession, EndsIfTheStartGateRefuses) {
  Drive run(SE2(0, 0, 2.0));
  const auto end = run.drive();
  ASSERT_TRUE(end);
  EXPECT_FALSE(end->finished || end->given_up);
  EXPECT_EQ(end->state, ReplayState::Refused);
  EXPECT_FALSE(end->reason.empty());
  EXPECT_EQ(run.robot.fastest_m_s, 0);
}

TEST(ReplaySession, EndsAfterWaitingTooLongForAnEstimate) {
  Drive run({}, true);
  const auto end = run.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->given_up);
  EXPECT_EQ(end->state, ReplayState::Waiting);
  EXPECT_NEAR(end->lap_s, 2, 0.15);
  EXPECT_EQ(run.robot.fastest_m_s, 0);
}

TEST(ReplaySession, EndsAfterBeingStoppedTooLongAndReportsWhy) {
  Drive run;
  run.robot.silent.from = milliseconds(2000);
  const auto end = run.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->given_up);
  EXPECT_FALSE(end->finished);
  EXPECT_EQ(end->state, ReplayState::Stopped);
  EXPECT_EQ(end->stops, 1);
  EXPECT_FALSE(end->reason.empty());
  EXPECT_EQ(run.robot.last(), VelocityCommand{});
  EXPECT_LT(to_seconds(run.robot.clock), 2 + 1 + 2) << "stops within one second, ends after two";
}

TEST(ReplaySession, EndsOnShouldStop) {
  Drive run;
  run.stop_at = milliseconds(3000);
  const auto end = run.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->interrupted);
  EXPECT_FALSE(end->finished || end->given_up);
  EXPECT_EQ(end->state, ReplayState::Driving);
  EXPECT_GT(run.robot.fastest_m_s, 0.1);
  EXPECT_EQ(run.robot.last(), VelocityCommand{});
}

TEST(ReplaySession, EndsWhenItsTimeIsOver) {
  Drive run;
  const auto end = run.drive(3);
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->timed_out);
  EXPECT_FALSE(end->finished || end->given_up || end->interrupted);
  EXPECT_EQ(run.robot.last(), VelocityCommand{});
}

TEST(ReplaySession, APauseDoesNotEndTheReplay) {
  Drive run;
  double paused_at_m = 0;
  double drove_on_m = 0;
  run.before = [&](Duration uptime) {
    if (uptime == milliseconds(2001)) run.session.pause();
    if (uptime == milliseconds(3001)) paused_at_m = run.robot.x_m();
    if (uptime != milliseconds(9001)) return;  // longer than give_up_s
    drove_on_m = run.robot.x_m() - paused_at_m;
    run.session.resume();
  };
  const auto end = run.drive();
  ASSERT_TRUE(end);
  EXPECT_GT(paused_at_m, 0.1);
  EXPECT_LT(drove_on_m, 0.001) << "it was stopped";
  EXPECT_TRUE(end->finished) << end->reason;
  EXPECT_EQ(end->stops, 1);
}

TEST(ReplaySession, ARequestPausesResumesAndEndsIt) {
  Drive paused;
  double paused_at_m = 0;
  paused.request = [&](Duration uptime) {
    SessionRequest request;
    if (uptime == milliseconds(2001)) request.pause = true;
    if (uptime == milliseconds(3001)) paused_at_m = paused.robot.x_m();
    if (uptime != milliseconds(9001)) return request;  // longer than give_up_s
    EXPECT_NEAR(paused.robot.x_m(), paused_at_m, 0.001) << "it was stopped";
    request.pause = false;
    return request;
  };
  const auto end = paused.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished) << end->reason;
  EXPECT_EQ(end->stops, 1);

  Drive ended;
  ended.request = [](Duration uptime) {
    return SessionRequest{.end = uptime > milliseconds(3000), .reason = "stopped on the page"};
  };
  const auto stopped = ended.drive();
  ASSERT_TRUE(stopped);
  EXPECT_FALSE(stopped->finished || stopped->interrupted || stopped->given_up);
  EXPECT_EQ(stopped->reason, "stopped on the page");
  EXPECT_GT(stopped->driven_m, 0.1);
  EXPECT_EQ(ended.robot.last(), VelocityCommand{});
}

// Simulates "2D Pose Estimate" in RViz while the robot is driving.
TEST(ReplaySession, AGivenPoseStopsTheRobotUntilResumed) {
  Drive run;
  double given_at_m = 0;
  std::string reason;
  run.request = [&](Duration uptime) {
    SessionRequest request;
    if (uptime == milliseconds(2001)) {
      given_at_m = run.robot.x_m();
      request.pose = GivenPose{SE2(given_at_m + 0.3, 0, 0), Eigen::Matrix3d::Identity() * 1e-4};
    }
    if (uptime == milliseconds(4001)) reason = run.session.end().reason;
    if (uptime != milliseconds(9001)) return request;  // longer than give_up_s
    EXPECT_LT(run.robot.x_m() - given_at_m, 0.1) << "it was stopped";
    EXPECT_EQ(run.robot.last(), VelocityCommand{});
    request.pause = false;
    return request;
  };
  const auto end = run.drive();
  ASSERT_TRUE(end);
  testing::expect_on_page("replay", reason);
  EXPECT_TRUE(end->finished) << end->reason;
  EXPECT_NEAR(run.robot.x_m(), 1.7, 0.1) << "the goal relative to the pose that was set";
}

TEST(ReplaySession, ContinuesAutomaticallyOnlyAfterAShortSilence) {
  Drive brief;
  brief.robot.silent = {milliseconds(2000), milliseconds(2800)};
  const auto end = brief.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished) << end->reason;
  EXPECT_EQ(end->stops, 1);

  Drive lasting;
  lasting.robot.silent = {milliseconds(2000), milliseconds(3450)};
  double stopped_at_m = 0;
  lasting.before = [&](Duration uptime) {
    if (uptime == milliseconds(3501)) stopped_at_m = lasting.robot.x_m();
  };
  const auto asked = lasting.drive();
  ASSERT_TRUE(asked);
  EXPECT_TRUE(asked->given_up) << "nothing resumed it";
  EXPECT_THAT(asked->reason, ::testing::HasSubstr("1.5 s"));
  testing::expect_on_page("replay", asked->reason);
  EXPECT_EQ(asked->reason.find("resume"), std::string::npos) << "no advice after the end";
  EXPECT_NEAR(lasting.robot.x_m(), stopped_at_m, 1e-9) << "it did not continue";

  Drive helped;
  helped.robot.silent = {milliseconds(2000), milliseconds(3500)};
  helped.before = [&](Duration uptime) {
    if (uptime == milliseconds(4001)) helped.session.resume();
  };
  const auto resumed = helped.drive();
  ASSERT_TRUE(resumed);
  EXPECT_TRUE(resumed->finished) << resumed->reason;
}

// The samples arrive late, so the motion in the meantime is unknown.
TEST(ReplaySession, StaysStoppedAfterTheComputerWasSuspended) {
  Replayer replayer = test::tiny_replayer();
  SE2 odom_T_base;
  SensorTime now(milliseconds(1));
  ReplayStep step;
  const auto drive = [&](int samples, bool commands) {
    for (int i = 0; i < samples; ++i) {
      now += milliseconds(50);
      odom_T_base = odom_T_base * SE2::exp({0.05 * step.command.speed_m_s, 0, 0});
      replayer.add(Odometry{.stamp = now, .odom_T_base = odom_T_base, .speed_m_s = step.command.speed_m_s});
      TagFrame frame{.stamp = now, .detections = std::vector<TagDetection>(2)};
      frame.detections[1].tag.number = 1;
      frame.detections[0].corners_px[0].x() = 0.05 * i;
      replayer.add(frame);
      if (commands) step = replayer.step(now);
    }
  };
  drive(30, true);
  EXPECT_GT(step.command.speed_m_s, 0.1);
  step.command = {};  // as commanded by the watchdog
  drive(30, false);
  drive(20, true);
  EXPECT_EQ(step.command, VelocityCommand{});
  EXPECT_THAT(step.reason.value_or(""), ::testing::HasSubstr("1.6 s"));
  testing::expect_on_page("replay", step.reason.value_or(""));
  replayer.resume();
  drive(20, true);
  EXPECT_GT(step.command.speed_m_s, 0.1) << step.reason.value_or("");
}

TEST(ReplaySession, ReportsARestartOfTheRobot) {
  Replayer replayer = test::tiny_replayer();
  std::vector<std::string> words;
  ReplaySession session(replayer, {.on_message = [&](const std::string& text) { words.push_back(text); }});
  int messages = 0;
  for (const double x_m : {2.0, 2.02, 0.0, 0.02})  // jumps back to the origin of odom
    ASSERT_TRUE(session.receive(
        Odometry{.stamp = SensorTime(milliseconds(50 * ++messages)), .odom_T_base = SE2(x_m, 0, 0)}));
  EXPECT_EQ(words.size(), 1U);
}

TEST(ReplaySession, AFailedRobotOrListenerIsAnError) {
  Drive dead;
  dead.robot.dies_after = milliseconds(2000);
  const auto end = dead.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "the robot's process ended");
  EXPECT_EQ(dead.robot.last(), VelocityCommand{});
  EXPECT_EQ(dead.session.end().state, ReplayState::Driving) << "the state so far is available";
  EXPECT_GT(dead.session.end().driven_m, 0.1);
  Drive full;
  full.fails_at_s = 1.5;
  const auto failed = full.drive();
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().message, "disk full");
  EXPECT_EQ(full.robot.last(), VelocityCommand{});
}

TEST(ReplaySession, AnUnconfirmedGivenPoseIsNotReportedAsMotionByHand) {
  test::TinyRobot robot{SE2()};
  Replayer replayer = test::tiny_replayer();
  double given_at_m = 0;
  ReplaySession session(replayer, {}, {.give_up_s = 2}, [&](Duration uptime) {
    SessionRequest request;
    if (uptime == milliseconds(2001)) {
      given_at_m = robot.x_m();
      request.pose = GivenPose{SE2(given_at_m + 1, 0, 0), Eigen::Matrix3d::Identity() * 100};
    }
    if (uptime == milliseconds(4001)) request.pause = false;
    return request;
  });
  RobotLoop loop(robot, robot, lockstep_time([&] { return robot.clock; }), {}, {.timeout_s = 60});
  const auto driven = loop.drive(session.listener());
  ASSERT_TRUE(driven);
  const ReplayEnd end = session.end(*driven);
  EXPECT_TRUE(end.given_up);
  EXPECT_THAT(end.reason, ::testing::Not(::testing::HasSubstr("by hand")));
  testing::expect_on_page("replay", end.reason);
  EXPECT_GT(given_at_m, 0.1) << "it was driving";
  EXPECT_LT(robot.x_m() - given_at_m, 0.1) << "it was stopped";
}

}  // namespace
}  // namespace waymark
