// Tests exploration in the robot loop, with a simulated robot and clock.
#include "waymark/runtime/explore_session.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/tiny_robot.hpp"

namespace waymark {
namespace {

using std::chrono::seconds;

/// A scan in which all ranges are equal.
LaserScan ring(float range_m) {
  return {.angle_min_rad = -3.1,
          .angle_increment_rad = 0.1,
          .range_min_m = 0.05,
          .range_max_m = 10,
          .ranges_m = std::vector<float>(63, range_m)};
}

/// One tag on a wall; frames from the robot contain this tag and another one that is not in the map.
TagMap one_tag() {
  TagMap map;
  map.tags[TagId{FamilyId::Tag36h11, 0}] = {.map_T_tag = SE3({}, {3, 0, 0.3}), .size_m = 0.2};
  return map;
}

Localizer localizer_of(const TagMap& map) {
  const PinholeRadtan projection{.fx = 400, .fy = 400, .cx = 320, .cy = 240};
  return Localizer::make({.landmarks = Landmarks(map),
                          .tags = map,
                          .sensor = {CameraModel::make(projection, 640, 480).value(), SE3()}})
      .value();
}

struct Tour {
  explicit Tour(double most_s = 5)
      : session(Explorer({}, test::tiny_model(), {}, Random(7)), localizer_of(one_tag()), one_tag(), most_s,
                {.on_sample = [this](const Sample&) -> Status {
                   ++samples;
                   if (fails_after && samples > *fails_after) return fail(ErrorCode::Unwritable, "disk full");
                   return {};
                 },
                 .on_step =
                     [this](SensorTime, const ExploreStep& step, const std::optional<LocalizationEstimate>&) {
                       states.push_back(step.state);
                       return Status();
                     },
                 .on_progress = [this](const std::string& line) { progress.push_back(line); }}) {
    robot.scan = [] { return ring(4); };
  }

  Result<ExploreEnd> drive() {
    RobotLoop loop(robot, robot, robot.pacing(), {}, {.timeout_s = 30});
    RobotListener listener = session.listener();
    listener.should_stop = [this] { return stop_at && robot.clock >= *stop_at; };
    const auto end = loop.drive(listener);
    EXPECT_EQ(robot.last(), VelocityCommand{});
    if (!end) return tl::unexpected(end.error());
    return session.end(*end);
  }

  test::TinyRobot robot{};
  std::optional<Duration> stop_at{};
  std::optional<int> fails_after{};
  int samples = 0;
  std::vector<ExploreState> states{};
  std::vector<std::string> progress{};
  ExploreSession session;
};

TEST(ExploreSession, RunsForItsTimeAndCountsMapTags) {
  Tour tour;
  const auto end = tour.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished);
  EXPECT_FALSE(end->interrupted);
  EXPECT_NEAR(end->seconds, 5, 0.1);
  EXPECT_TRUE(end->halt_reason.empty());
  EXPECT_GT(tour.robot.fastest_m_s, 0.2);
  ASSERT_EQ(end->seen.size(), 1U) << "the other tag is not in the map";
  EXPECT_NEAR(end->seen.begin()->second, 100, 2);
  EXPECT_THAT(tour.progress.back(),
              ::testing::AllOf(::testing::HasSubstr("5 of 5 s"), ::testing::HasSubstr("1 of 1")));
  testing::expect_on_page("session", tour.progress.back());
  EXPECT_EQ(tour.states.size(), tour.progress.size());
}

TEST(ExploreSession, TurnsAtAnObstacle) {
  Tour tour;
  tour.robot.scan = [&] { return ring(tour.robot.clock < seconds(2) ? 4.0F : 0.3F); };
  const auto end = tour.drive();
  ASSERT_TRUE(end);
  EXPECT_GT(end->turns, 0);
  EXPECT_NE(std::ranges::find(tour.states, ExploreState::Turn), tour.states.end());
}

TEST(ExploreSession, StopsWithoutScansAndReportsWhy) {
  Tour blind;
  blind.robot.scan = [] { return std::nullopt; };
  auto end = blind.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished);
  EXPECT_FALSE(end->halt_reason.empty());
  EXPECT_EQ(blind.robot.fastest_m_s, 0);

  Tour later;
  later.robot.scan = [&]() -> std::optional<LaserScan> {
    if (later.robot.clock < seconds(2)) return ring(4);
    return std::nullopt;
  };
  end = later.drive();
  ASSERT_TRUE(end);
  EXPECT_FALSE(end->halt_reason.empty());
  EXPECT_LT(later.robot.x_m(), 3 * 0.3) << "stopped when the scans ended";
}

TEST(ExploreSession, ContinuesWithoutACamera) {
  Tour tour;
  tour.robot.camera_silent = {seconds(1), seconds(9)};
  const auto end = tour.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished);
  testing::expect_on_page("session", tour.progress.back());
}

TEST(ExploreSession, ASignalInterruptsIt) {
  Tour tour;
  tour.stop_at = seconds(2);
  const auto end = tour.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->interrupted);
  EXPECT_FALSE(end->finished);
  EXPECT_NEAR(end->seconds, 2, 0.1);
}

TEST(ExploreSession, AnyErrorEndsItWithZero) {
  Tour dead;
  dead.robot.dies_after = seconds(2);
  auto end = dead.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "the robot's process ended");
  EXPECT_FALSE(dead.session.end().finished);
  EXPECT_EQ(dead.session.end().seen.size(), 1U) << "the state so far is available";
  Tour full;
  full.fails_after = 60;
  end = full.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "disk full");
}

}  // namespace
}  // namespace waymark
