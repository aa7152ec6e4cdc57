// Laws for any fault: no tag is touched, no motion after a lasting stop, the right reason; and faults that
// can be tolerated are.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "replay_course.hpp"
#include "waymark/base/random.hpp"

namespace waymark::replay_course {
namespace {

const Course& course() {
  static const Course made = circuit24();
  return made;
}

ReplayOptions at_speed(double speed_m_s, double laps = 1) {
  ReplayOptions options{.laps = laps};
  options.profile.speed_m_s = speed_m_s;
  options.safety.max_speed_m_s = std::max(0.5, 1.2 * speed_m_s);
  return options;
}

void print(const char* name, const Outcome& outcome) {
  std::printf("%-28s %s rmse %.4f p95 %.4f max %.4f m, %.2f deg, gain %.2f, stops %d%s%s\n", name,
              outcome.end.finished ? "done" : "STOP", outcome.judged.cross_track_rmse_m,
              outcome.judged.cross_track_p95_m, outcome.judged.cross_track_max_m,
              outcome.judged.heading_rmse_deg, outcome.turn_gain, outcome.end.stops,
              outcome.reasons.empty() ? "" : ": ", outcome.reasons.empty() ? "" : outcome.reasons[0].c_str());
}

class Gains : public ::testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(TurnGain, Gains, ::testing::Values(0.6, 0.8, 1.0));

TEST_P(Gains, TheFollowerTracksTheRouteForAnyTurnGain) {
  Trial trial{.seed = 3, .turn_gain = GetParam(), .replay = at_speed(0.4, 2)};
  const Outcome follower = drive(course(), trial);
  print("follower 0.4 m/s", follower);
  EXPECT_TRUE(follower.end.finished) << follower.end.reason;
  EXPECT_EQ(follower.judged.laps_completed, 2);
  EXPECT_LT(follower.judged.cross_track_rmse_m, 0.010);
  EXPECT_LT(follower.judged.cross_track_p95_m, 0.020);
  EXPECT_LT(follower.judged.cross_track_max_m, 0.030);
  EXPECT_LT(follower.judged.heading_rmse_deg, 1.0);
  EXPECT_NEAR(follower.turn_gain, GetParam(), 0.1);
  trial.replay = at_speed(0.8, 2);
  const Outcome fast = drive(course(), trial);
  print("follower 0.8 m/s", fast);
  EXPECT_TRUE(fast.end.finished) << fast.end.reason;
  EXPECT_LT(fast.judged.cross_track_rmse_m, 0.020);
}

TEST(Controllers, TheBaselinesCompleteTheRoute) {
  for (const ReplayController controller : {ReplayController::Pursuit, ReplayController::Pose}) {
    const std::string name(to_string(controller));
    Trial trial{.seed = 3, .replay = at_speed(0.4)};
    trial.replay.controller = controller;
    const Outcome outcome = drive(course(), trial);
    print(name.c_str(), outcome);
    EXPECT_TRUE(outcome.end.finished) << name << outcome.end.reason;
    EXPECT_LT(outcome.judged.cross_track_max_m, 0.3);
  }
}

TEST(Ackermann, ASteeredRobotFollowsWithinItsCurvature) {
  const Course steered = circuit24("limo-ackermann");
  Trial trial{.seed = 3, .turn_gain = 1, .replay = at_speed(0.4)};
  trial.replay.safety.max_curvature_1_m = 2.5;
  const Outcome outcome = drive(steered, trial);
  print("ackermann 0.4 m/s", outcome);
  EXPECT_TRUE(outcome.end.finished) << outcome.end.reason;
  EXPECT_LT(outcome.judged.cross_track_max_m, 0.06);
}

TagId tag(int number) {
  TagId id = course().world.anchor;
  id.number = number;
  return id;
}

TEST(Faults, ToleratedFaultsDoNotEndTheReplay) {
  const std::vector<std::pair<const char*, std::vector<Fault>>> scripts = {
      {"blackout of 5 s", {{.kind = FaultKind::CameraBlackout, .at_s = 12, .for_s = 5}}},
      {"3 of 24 tags removed",
       {{.kind = FaultKind::TagRemoved, .tag = tag(3)},
        {.kind = FaultKind::TagRemoved, .tag = tag(9)},
        {.kind = FaultKind::TagRemoved, .tag = tag(17)}}},
      {"slip burst", {{.kind = FaultKind::SlipBurst, .at_s = 15, .for_s = 0.5, .speed_share = 0.3}}},
      {"camera frozen for 1 s", {{.kind = FaultKind::CameraFrozen, .at_s = 15, .for_s = 1}}},
      {"odometry lost for 2 s", {{.kind = FaultKind::OdometryLost, .at_s = 15, .for_s = 2}}},
  };
  for (const auto& [name, faults] : scripts) {
    const Outcome outcome = drive(course(), {.seed = 4, .faults = faults, .replay = at_speed(0.4)});
    print(name, outcome);
    EXPECT_TRUE(outcome.end.finished) << name << ": " << outcome.end.reason;
    EXPECT_LT(outcome.judged.cross_track_max_m, 0.06) << name;
  }
}

TEST(Faults, OtherFaultsStopItWithTheRightReason) {
  const auto stop = [](const char* name, const Fault& fault, const char* part) {
    const Outcome outcome = drive(course(), {.seed = 5, .faults = {fault}, .replay = at_speed(0.4)});
    print(name, outcome);
    EXPECT_FALSE(outcome.end.finished) << name;
    EXPECT_THAT(outcome.end.reason, ::testing::HasSubstr(part)) << name;
    EXPECT_LT(outcome.moved_after_stop_m, 0.005) << name;
  };
  stop("odometry lost", {.kind = FaultKind::OdometryLost, .at_s = 15}, "odometry is");
  for (const double forward_m : {1.0, -1.0})
    stop("kidnapped along",
         {.kind = FaultKind::Kidnapped, .at_s = 15, .for_s = 0, .base_T_put = SE2(forward_m, 0, 0)},
         "by hand");
  stop("kidnapped aside",
       {.kind = FaultKind::Kidnapped, .at_s = 15, .for_s = 0, .base_T_put = SE2(0, 1, 0.3)}, "by hand");
  for (const double jump_s : {0.5, -0.5, 100.0})
    stop("clock jump", {.kind = FaultKind::ClockJump, .at_s = 15, .for_s = 0, .jump_s = jump_s}, "clock");
  stop("camera frozen for good", {.kind = FaultKind::CameraFrozen, .at_s = 15}, "same image");
  stop("camera dark for good", {.kind = FaultKind::CameraBlackout, .at_s = 15}, "accepted tag");
}

TEST(Faults, AMovedTagIsToleratedOrReported) {
  for (const int number : {3, 9, 17}) {
    const Outcome outcome = drive(course(), {.seed = 6,
                                             .faults = {{.kind = FaultKind::TagMoved,
                                                         .tag = tag(number),
                                                         .shift_m = Eigen::Vector3d(0.14, 0.14, 0)}},
                                             .replay = at_speed(0.4)});
    print("tag moved by 20 cm", outcome);
    const bool named = outcome.end.reason.find(to_string(tag(number))) != std::string::npos;
    EXPECT_TRUE(outcome.end.finished || named) << outcome.end.reason;
    EXPECT_GT(outcome.judged.min_clearance_m, 0.15);
  }
}

// A robot placed in front of a tag by hand during the drive stops within its reaction time: the first
// contradicting frame brakes.
TEST(Faults, ARobotMovedByHandBrakesAtTheFirstFrame) {
  for (const SE2& put : {SE2(0.6, 0, 0), SE2(-0.5, 0.3, 0.4), SE2(0, -0.6, -0.3)}) {
    const Trial trial{.seed = 8,
                      .faults = {{.kind = FaultKind::Kidnapped, .at_s = 15, .for_s = 0, .base_T_put = put}},
                      .replay = at_speed(0.4)};
    const Outcome outcome = drive(course(), trial);
    print("carried", outcome);
    EXPECT_GT(outcome.after_carry_m, 0.05);
    EXPECT_LT(outcome.after_carry_m, outcome.reaction_m);
  }
}

constexpr double kScriptSpeed_m_s = 0.4;

struct Script {
  std::vector<Fault> faults;
  bool survivable = true;
  bool slips = false;  ///< by more than wheels and tags may differ: the replay may stop with that reason
};

Script random_script(Random& random) {
  Script script;
  const auto count = 1 + random.index(3);
  for (std::uint64_t i = 0; i < count; ++i) {
    Fault fault{.at_s = random.uniform(3, 45), .for_s = random.uniform(0.1, 4)};
    fault.tag = tag(static_cast<int>(random.index(24)));
    switch (random.index(10)) {
      case 0:
        fault.kind = FaultKind::CameraBlackout;
        break;
      case 1:
        fault.kind = FaultKind::CameraFrozen;
        break;
      case 2:
        fault.kind = FaultKind::CameraLost;
        break;
      case 3:
        fault.kind = FaultKind::OdometryLost;
        break;
      case 4:
        fault.kind = FaultKind::TagRemoved;
        break;
      case 5:
        fault.kind = FaultKind::SlipBurst;
        fault.for_s = random.uniform(0.1, 1);
        fault.speed_share = random.uniform(0.2, 1);
        fault.yaw_share = random.uniform(0.3, 1);
        script.slips |=
            kScriptSpeed_m_s * fault.for_s * (1 - fault.speed_share) > ConsistencyOptions{}.contradiction_m;
        break;
      case 6:
        fault.kind = FaultKind::TagMoved;
        fault.shift_m = {random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0};
        script.survivable = false;
        break;
      case 7:
        fault.kind = FaultKind::TagsSwapped;
        fault.other = tag((fault.tag.number + 1 + static_cast<int>(random.index(23))) % 24);
        script.survivable = false;
        break;
      case 8:
        fault.kind = FaultKind::Kidnapped;
        fault.for_s = 0;
        fault.base_T_put = SE2(random.uniform(-1, 1), random.uniform(-0.3, 0.3), random.uniform(-0.5, 0.5));
        script.survivable = false;
        break;
      default:
        fault.kind = FaultKind::ClockJump;
        fault.for_s = 0;
        fault.jump_s = random.uniform(-2, 2);
        script.survivable = false;
        break;
    }
    script.faults.push_back(fault);
  }
  return script;
}

// A thousand under WAYMARK_FULL; WAYMARK_SCRIPT=945 drives that one alone.
TEST(Faults, RandomScripts) {
  const char* const only = std::getenv("WAYMARK_SCRIPT");
  const int count = only != nullptr || std::getenv("WAYMARK_FULL") != nullptr ? 1000 : 30;
  Random random(20261121);
  int survivable = 0;
  int survived = 0;
  int slipped = 0;
  int stopped = 0;
  for (int i = 0; i < count; ++i) {
    const Script script = random_script(random);
    const Trial trial{.seed = static_cast<std::uint64_t>(100 + i),
                      .turn_gain = random.uniform(0.6, 1),
                      .faults = script.faults,
                      .replay = at_speed(kScriptSpeed_m_s)};
    if (only != nullptr && std::atoi(only) != i) continue;
    const Outcome outcome = drive(course(), trial);
    if (only != nullptr) print("script", outcome);
    EXPECT_LE(outcome.keep_out_breach_m, 0) << "script " << i;
    EXPECT_LT(outcome.moved_after_stop_m, 0.005) << "script " << i;
    EXPECT_LE(outcome.fastest_m_s, 0.5) << "script " << i;
    EXPECT_TRUE(outcome.end.finished || !outcome.end.reason.empty()) << "script " << i << ": no reason";
    stopped += outcome.end.finished ? 0 : 1;
    if (!script.survivable) continue;
    if (script.slips && outcome.end.reason.find("wheels and tags") != std::string::npos) {
      ++slipped;
      continue;
    }
    ++survivable;
    survived += outcome.end.finished ? 1 : 0;
    if (!outcome.end.finished) print("not survived", outcome);
  }
  std::printf("%d scripts: %d of %d survivable ones completed, %d stopped, %d of them by a slip\n", count,
              survived, survivable, stopped, slipped);
  EXPECT_GE(survived, 0.98 * survivable);
}

}  // namespace
}  // namespace waymark::replay_course
