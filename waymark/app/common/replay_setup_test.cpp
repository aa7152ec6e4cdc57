#include "waymark/app/common/replay_setup.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recorded_lap.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/replay/route_builder.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const RobotDescription& replay_robot() {
  static const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo.yaml").value();
  return robot;
}

/// The route driven by the scripted driver in circuit24.
const Route& true_route() {
  static const Route route = build_route(test::drive(3).truth).value();
  return route;
}

/// A folder with a perfect map of circuit24.
class ReplaySetup : public ::testing::Test {
 protected:
  void SetUp() override {
    MapFile map{.tags = test::circuit().tags, .anchor = test::circuit().anchor};
    for (auto& [tag, mapped] : map.tags.tags) mapped.covariance = Matrix6(Matrix6::Identity() * 1e-6);
    ASSERT_TRUE(write_map(folder_ / "map.yaml", map));
    ASSERT_TRUE(write_route(folder_ / "route.yaml", with_map(true_route(), map.tags)));
    ASSERT_TRUE(write_text_file(folder_ / "robot.yaml", test::file_text(WAYMARK_SHARE "/robots/limo.yaml")));
  }
  fs::path folder_ = testing::fresh_folder("jobs_replay_setup");
};

TEST_F(ReplaySetup, AMapFolderSufficesForAReplay) {
  const auto folder = read_map_folder(folder_);
  ASSERT_TRUE(folder) << to_string(folder.error());
  EXPECT_EQ(folder->map.tags.tags.size(), test::circuit().tags.tags.size());
  EXPECT_EQ(folder->robot->model.name, replay_robot().model.name);
  const auto replayer = make_replayer(*folder);
  ASSERT_TRUE(replayer) << to_string(replayer.error());
  const SimulatedSetup simulated{test::circuit(), folder->robot->model, folder->robot->camera, {.seed = 12}};
  const auto end = drive_replay(simulated, **replayer, {});
  ASSERT_TRUE(end) << to_string(end.error());
  EXPECT_TRUE(end->finished) << end->reason;
  EXPECT_EQ(end->stops, 0);
  EXPECT_NEAR(end->driven_m, folder->route.length_m, 0.2);
}

TEST_F(ReplaySetup, OptionsArePassedToTheReplayer) {
  const MapFolder folder = read_map_folder(folder_).value();
  ReplayerSetup setup;
  setup.replay.laps = 2;
  setup.replay.profile.speed_m_s = 0.5;
  setup.replay.safety.max_speed_m_s = 0.6;
  const auto replayer = make_replayer(folder, setup);
  ASSERT_TRUE(replayer);
  const SimulatedSetup simulated{test::circuit(), folder.robot->model, folder.robot->camera, {.seed = 4}};
  double fastest_m_s = 0;
  LapListener listener;
  listener.on_step = [&](SensorTime, const ReplayStep& step) {
    fastest_m_s = std::max(fastest_m_s, step.command.speed_m_s);
    return Status();
  };
  const auto end = drive_replay(simulated, **replayer, listener);
  ASSERT_TRUE(end);
  EXPECT_NEAR(end->driven_m, 2 * folder.route.length_m, 0.3);
  EXPECT_NEAR(fastest_m_s, 0.5, 0.05);
}

TEST_F(ReplaySetup, TheLongestSegmentWithoutTagsIsComputedIfMissing) {
  const MapFolder folder = read_map_folder(folder_).value();
  ASSERT_FALSE(folder.route.longest_without_tags_m);
  const auto replayer = make_replayer(folder, replay_robot());
  ASSERT_TRUE(replayer);
  ASSERT_TRUE((*replayer)->route().longest_without_tags_m);
  EXPECT_LT(*(*replayer)->route().longest_without_tags_m, 2);
}

TEST_F(ReplaySetup, ARouteThatWasTaughtSidewaysIsRefused) {
  MapFolder folder = read_map_folder(folder_).value();
  EXPECT_TRUE(check_drivable(folder));
  for (RoutePoint& point : folder.route.points) {
    const SE2& at = point.map_T_base;
    point.map_T_base = SE2(at.x(), at.y(), at.yaw() - M_PI / 2);
  }
  ASSERT_TRUE(write_route(folder_ / "route-left.yaml", folder.route));
  folder = read_map_folder(folder_, "left").value();
  const auto replayer = make_replayer(folder);
  ASSERT_FALSE(replayer);
  EXPECT_EQ(replayer.error().code, ErrorCode::Unsupported);
  EXPECT_EQ(replayer.error().place.source, (folder_ / "route-left.yaml").string());
  EXPECT_EQ(replayer.error().place.key, "points[0]");
}

TEST_F(ReplaySetup, ASmallAngleToTheMotionIsDrivenAhead) {
  MapFolder folder = read_map_folder(folder_).value();
  const auto usual = make_replayer(folder);
  ASSERT_TRUE(usual);
  for (RoutePoint& point : folder.route.points) {
    const SE2& at = point.map_T_base;
    point.map_T_base = SE2(at.x(), at.y(), at.yaw() + 0.2);
  }
  const auto replayer = make_replayer(folder);
  ASSERT_TRUE(replayer) << to_string(replayer.error());
  for (std::size_t i = 0; i < folder.route.points.size(); ++i)
    EXPECT_EQ((*replayer)->route().points[i].map_T_base, (*usual)->route().points[i].map_T_base);
}

TEST_F(ReplaySetup, AFolderWithoutRobotFileRequiresARobot) {
  fs::remove(folder_ / "robot.yaml");
  const auto folder = read_map_folder(folder_);
  ASSERT_TRUE(folder) << to_string(folder.error());
  EXPECT_FALSE(folder->robot);
  const auto without = make_replayer(*folder);
  ASSERT_FALSE(without);
  EXPECT_EQ(without.error().code, ErrorCode::NotFound);
  EXPECT_EQ(without.error().place.source, (folder_ / "robot.yaml").string());
  EXPECT_TRUE(make_replayer(*folder, replay_robot()));
}

TEST_F(ReplaySetup, AnInvalidRobotFileIsAnErrorOnlyIfItIsUsed) {
  ASSERT_TRUE(write_text_file(folder_ / "robot.yaml", "name: [limo\n"));
  const auto folder = read_map_folder(folder_);
  ASSERT_FALSE(folder);
  EXPECT_EQ(folder.error().place.source, (folder_ / "robot.yaml").string());
  const auto other = read_map_and_route(folder_);
  ASSERT_TRUE(other) << "not read for a robot that is described elsewhere";
  EXPECT_FALSE(other->robot);
}

TEST_F(ReplaySetup, MissingFilesAreReported) {
  const auto route = read_map_folder(folder_, "kitchen");
  ASSERT_FALSE(route);
  EXPECT_EQ(route.error().place.key, "`route`");
  ASSERT_TRUE(write_route(folder_ / "route-kitchen.yaml", true_route()));
  EXPECT_TRUE(read_map_folder(folder_, "kitchen"));
  EXPECT_FALSE(read_map_folder(folder_ / "none"));
  fs::remove(folder_ / "map.yaml");
  const auto map = read_map_folder(folder_);
  ASSERT_FALSE(map);
  EXPECT_THAT(map.error().hint, HasSubstr("waymark map"));
}

TEST_F(ReplaySetup, ARouteOfAnotherMapIsRefused) {
  MapFile other{.tags = test::circuit().tags, .anchor = test::circuit().anchor};
  for (auto& [tag, mapped] : other.tags.tags)
    mapped.map_T_tag = SE3(SO3::from_rpy(0, 0, 0.5), {3, 1, 0}) * mapped.map_T_tag;
  ASSERT_TRUE(write_map(folder_ / "map.yaml", other));
  const auto folder = read_map_folder(folder_);
  ASSERT_FALSE(folder);
  EXPECT_EQ(folder.error().place.source, (folder_ / "route.yaml").string());
}

}  // namespace
}  // namespace waymark
