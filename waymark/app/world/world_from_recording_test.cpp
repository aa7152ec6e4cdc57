// A robot with hidden simulation options drives a lap. The options of its twin are estimated from the
// recording and the map.
#include "waymark/app/world/world_from_recording.hpp"

#include <filesystem>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/app/teach/teach_lap.hpp"
#include "waymark/config/yaml/world_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kTolerance = 0.2;  // relative tolerance

/// Sets options that do not occur in any of the files read by the job.
void set_hidden_values(SimulatedRobotOptions& robot) {
  robot.camera_rate_hz = 12;
  robot.camera_latency_s = 0.07;
  robot.odometry_rate_hz = 30;
  robot.dynamics.turn_gain = 0.6;
  robot.sensors.left_wheel_scale = 0.95;
  robot.sensors.right_wheel_scale = 0.95;
  robot.sensors.gyro_noise_rad_s = 0.012;
  robot.tag_camera.corner_sigma_px = 0.25;
  robot.tag_camera.small_tag_sigma_px = 0;
  robot.tag_camera.miss_probability = 0.1;
  robot.tag_camera.max_range_m = 2.6;
}

class WorldOfADrivenLap : public ::testing::Test {
 protected:
  void SetUp() override {
    RobotSetup hidden = usual_;
    set_hidden_values(hidden.simulated.robot);
    ASSERT_TRUE(teach_lap(hidden, {.output = lap()}, {}));
    ASSERT_TRUE(map_recording({.lap = lap(), .folder = folder_ / "map"}, {}));
  }
  [[nodiscard]] std::string lap() const { return (folder_ / "lap.mcap").string(); }
  [[nodiscard]] WorldFromRecordingJob job() const {
    return {.recording = lap(), .map = folder_ / "map", .folder = folder_ / "twin", .robot = "limo"};
  }

  const fs::path folder_ =
      testing::fresh_folder(::testing::UnitTest::GetInstance()->current_test_info()->name());
  const RobotSetup usual_ = load_setup("circuit24", "", 1).value();
};

TEST_F(WorldOfADrivenLap, EstimatesHiddenRobotOptionsWithinTwentyPercent) {
  const auto report = world_from_recording(job(), {});
  ASSERT_TRUE(report) << to_string(report.error());
  const auto robot = read_robot(folder_ / "twin/robot.yaml");
  ASSERT_TRUE(robot) << to_string(robot.error());
  SimulatedRobotOptions hidden = usual_.simulated.robot;
  set_hidden_values(hidden);
  const SimulatedRobotOptions& found = robot->simulation;
  const std::map<std::string, std::pair<double, double>> expected = {
      {"camera rate", {found.camera_rate_hz, hidden.camera_rate_hz}},
      {"latency", {found.camera_latency_s, hidden.camera_latency_s}},
      {"odometry rate", {found.odometry_rate_hz, hidden.odometry_rate_hz}},
      {"turn response", {found.dynamics.turn_gain, hidden.dynamics.turn_gain}},
      {"gyro noise", {found.sensors.gyro_noise_rad_s, hidden.sensors.gyro_noise_rad_s}},
      {"corner noise", {found.tag_camera.corner_sigma_px, hidden.tag_camera.corner_sigma_px}},
      {"missed tags", {found.tag_camera.miss_probability, hidden.tag_camera.miss_probability}},
      {"range", {found.tag_camera.max_range_m, hidden.tag_camera.max_range_m}}};
  for (const auto& [name, values] : expected)
    EXPECT_NEAR(values.first, values.second, kTolerance * values.second) << name;
  EXPECT_NEAR(found.sensors.left_wheel_scale, hidden.sensors.left_wheel_scale, 0.02);
}

TEST_F(WorldOfADrivenLap, TheWorldMatchesTheMapAndCanBeDriven) {
  ASSERT_TRUE(world_from_recording(job(), {}));
  const auto world = read_world(folder_ / "twin/world.yaml");
  ASSERT_TRUE(world) << to_string(world.error());
  EXPECT_TRUE(world->path_closed);
  EXPECT_EQ(world->tags.tags.size(), usual_.simulated.world.tags.tags.size());
  const RobotSetup twin =
      load_setup((folder_ / "twin/world.yaml").string(), (folder_ / "twin/robot.yaml").string(), 9).value();
  const auto driven = teach_lap(twin, {.output = (folder_ / "sim.mcap").string()}, {});
  ASSERT_TRUE(driven) << to_string(driven.error());
  EXPECT_TRUE(driven->summary.closed_loop);
}

TEST_F(WorldOfADrivenLap, RejectsAMapOfAnotherPlaceAndWritesNothing) {
  const std::string lap_there = (folder_ / "other.mcap").string();
  ASSERT_TRUE(teach_lap(load_setup("mbot-square", "limo", 1).value(), {.output = lap_there}, {}));
  ASSERT_TRUE(map_recording({.lap = lap_there, .folder = folder_ / "other"}, {}));
  WorldFromRecordingJob other = job();
  // The time of this map matches, because both recordings start at the same time.
  other.map = folder_ / "other";
  const auto elsewhere = world_from_recording(other, {});
  ASSERT_FALSE(elsewhere);
  EXPECT_EQ(elsewhere.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(elsewhere.error().message, HasSubstr("tags"));
  other.map = folder_ / "nowhere";
  EXPECT_FALSE(world_from_recording(other, {}));
  other = job();
  other.robot = "limu";
  const auto unknown = world_from_recording(other, {});
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().hint, HasSubstr("limo"));
  EXPECT_FALSE(fs::exists(folder_ / "twin"));
}

TEST_F(WorldOfADrivenLap, RejectsANonEmptyFolder) {
  WorldFromRecordingJob into_map = job();
  into_map.folder = into_map.map;
  const auto refused = world_from_recording(into_map, {});
  ASSERT_FALSE(refused);
  EXPECT_FALSE(refused.error().hint.empty());
  EXPECT_FALSE(fs::exists(folder_ / "map/world.yaml"));
  EXPECT_FALSE(fs::exists(folder_ / "map/robot.1.yaml"));
}

/// The first 15 s of a lap, and the map made from them.
struct MappedDrive {
  fs::path folder = testing::fresh_folder("jobs_world_from");
  std::string lap = test::record_lap(folder / "lap.mcap", 31, {.for_s = 15});
  fs::path map = folder / "map";
  MappedDrive() { EXPECT_TRUE(map_recording({.lap = lap, .folder = map}, {})); }
};

const MappedDrive& mapped_drive() {
  static const MappedDrive made;
  return made;
}

TEST(WorldFromRecording, WritesTagsRouteAndRobotBehaviour) {
  const fs::path folder = mapped_drive().folder / "world";
  const auto report = world_from_recording(
      {.recording = mapped_drive().lap, .map = mapped_drive().map, .folder = folder}, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_THAT(report->files, ElementsAre("world.yaml", "robot.yaml"));
  const auto world = read_world(folder / "world.yaml");
  ASSERT_TRUE(world) << to_string(world.error());
  EXPECT_EQ(world->tags.tags.size(), report->world.tags.tags.size());
  EXPECT_GE(world->path_m.size(), 10U);
  for (const auto& [id, tag] : world->tags.tags)
    EXPECT_LT((tag.map_T_tag.translation() - test::circuit().tags.find(id)->map_T_tag.translation())
                  .head<2>()
                  .norm(),
              0.1)
        << id.number;
  const auto robot = read_robot(folder / "robot.yaml");
  ASSERT_TRUE(robot) << to_string(robot.error());
  EXPECT_NEAR(robot->simulation.camera_rate_hz, test::limo().simulation.camera_rate_hz, 1);
  const std::string text = to_text(*report, folder);
  EXPECT_THAT(text, AllOf(HasSubstr("waymark teach --world "), HasSubstr("not determined")));
  const auto json = to_json(fields(*report));
  EXPECT_TRUE(json["quantities"]["camera.exposure_ms"].is_null()) << "the recording contains no images";
}

TEST(WorldFromRecording, RejectsAMapOfAnotherDrive) {
  const std::string other =
      test::record_lap(mapped_drive().folder / "other.mcap", 32, {.for_s = 3, .odometry = true});
  // The place and time are the same, but the tags in the map have been moved.
  const fs::path moved = mapped_drive().folder / "moved";
  fs::copy(mapped_drive().map, moved);
  MapFile map = read_map(moved / "map.yaml").value();
  for (auto& [id, tag] : map.tags.tags) tag.map_T_tag = SE3({}, {0, 0, 0.7}) * tag.map_T_tag;
  ASSERT_TRUE(write_map(moved / "map.yaml", map));
  const fs::path folder = mapped_drive().folder / "refused";
  const auto report = world_from_recording({.recording = other, .map = moved, .folder = folder}, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(report.error().message, HasSubstr("tags"));
  EXPECT_THAT(report.error().hint, HasSubstr("waymark map "));
  EXPECT_FALSE(fs::exists(folder));
}

TEST(WorldFromRecording, NamesMissingInputsAndWritesNothingIfCancelled) {
  const fs::path folder = mapped_drive().folder / "none";
  const auto no_map =
      world_from_recording({.recording = mapped_drive().lap, .map = "/nowhere", .folder = folder}, {});
  ASSERT_FALSE(no_map);
  EXPECT_THAT(to_string(no_map.error()), HasSubstr("/nowhere"));
  const fs::path bare = mapped_drive().folder / "bare";
  fs::copy(mapped_drive().map, bare);
  fs::remove(bare / "robot.yaml");
  const auto no_robot =
      world_from_recording({.recording = mapped_drive().lap, .map = bare, .folder = folder}, {});
  ASSERT_FALSE(no_robot);
  EXPECT_THAT(no_robot.error().hint, HasSubstr("`robot`"));
  for (const int checks : {0, 5, 200}) {
    EXPECT_FALSE(
        world_from_recording({.recording = mapped_drive().lap, .map = mapped_drive().map, .folder = folder},
                             test::cancelled_after(checks)))
        << checks;
    EXPECT_FALSE(fs::exists(folder)) << checks;
  }
}

}  // namespace
}  // namespace waymark
