// Tests in real time, with robots written as a few lines of shell, that the watchdog stops them when their
// driver ends.
#include "waymark/app/commission/stop_trials.hpp"

#include <cstdlib>

#include <gtest/gtest.h>

#include "waymark/runtime/commission_lines.hpp"

namespace waymark {
namespace {

/// A robot that drives at the last commanded speed and ignores lines that match the shell pattern
/// `passes_over`.
std::unique_ptr<ProcessRobot> robot(const std::string& passes_over) {
  const std::string script =
      R"(echo '{"type":"hello","protocol_version":1,"name":"tiny"}'; v=0; while true; do )"
      R"(while read -t 0.001 line; do case "$line" in *bye*) exit 0;; )" +
      passes_over +
      R"( *velocity*) v=${line#*speed_m_s\":}; v=${v%%,*};; esac; done; sleep 0.02; )"
      R"(echo "{\"type\":\"odometry\",\"stamp_ns\":$(date +%s%N),\"x_m\":0,\"y_m\":0,\"yaw_rad\":0,\"speed_m_s\":$v,\"yaw_rate_rad_s\":0}"; done)";
  auto started = ProcessRobot::start(RobotCommand(std::vector<std::string>{"/bin/bash", "-c", script}));
  EXPECT_TRUE(started) << to_string(started.error());
  return started ? std::move(*started) : nullptr;
}

constexpr const char* kAll = "";
constexpr const char* kNoStops = "*\\\"stop\\\"*) ;;";

TEST(StopTrials, TheWatchdogStopsARobotWhoseDriverIsKilled) {
  const auto obedient = robot(kAll);
  ASSERT_NE(obedient, nullptr);
  const auto trace = kill_driver(*obedient, {.drives_s = 1});
  ASSERT_TRUE(trace) << to_string(trace.error());
  const CommissionLine line = judge_stop("stop.kill", timing_of(*trace), 0.25);
  EXPECT_EQ(line.verdict, CommissionVerdict::Ok) << line.message;
}

TEST(StopTrials, ARobotThatIgnoresTheWatchdogFails) {
  if (std::getenv("WAYMARK_FULL") == nullptr) GTEST_SKIP() << "WAYMARK_FULL: some seconds";
  const auto stubborn = robot(kNoStops);
  ASSERT_NE(stubborn, nullptr);
  const auto silent = fall_silent(*stubborn, {.drives_s = 1});
  ASSERT_TRUE(silent) << to_string(silent.error());
  EXPECT_EQ(judge_stop("stop.silence", timing_of(*silent), 0.25).verdict, CommissionVerdict::Fail);
  const auto killed = kill_driver(*stubborn, {.drives_s = 1});
  ASSERT_TRUE(killed) << to_string(killed.error());
  EXPECT_EQ(judge_stop("stop.kill", timing_of(*killed), 0.25).verdict, CommissionVerdict::Fail);
}

TEST(StopTrials, CancellingEndsTheDriver) {
  const auto obedient = robot(kAll);
  ASSERT_NE(obedient, nullptr);
  int asked = 0;
  EXPECT_FALSE(kill_driver(*obedient, {.cancelled = [&] { return ++asked > 60; }}));
  EXPECT_FALSE(fall_silent(*robot(kAll), {.cancelled = [] { return true; }}));
}

TEST(StopTrials, DetectsSilenceByTheAgeOfTheLastOdometry) {
  if (std::getenv("WAYMARK_FULL") == nullptr) GTEST_SKIP() << "WAYMARK_FULL: some seconds";
  const auto obedient = robot(kAll);
  ASSERT_NE(obedient, nullptr);
  const auto none = await_silence(*obedient, 0.8, [] { return false; });
  ASSERT_TRUE(none);
  EXPECT_FALSE(*none) << "odometry still arrives";
  const auto silent = robot("*velocity*) sleep 3;;");
  const auto silent_s = await_silence(*silent, 3, [] { return false; });
  ASSERT_TRUE(silent_s && *silent_s);
  EXPECT_GE(**silent_s, 0.5);
  EXPECT_LT(**silent_s, 2);
}

}  // namespace
}  // namespace waymark
