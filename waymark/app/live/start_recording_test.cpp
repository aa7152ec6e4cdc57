#include "waymark/app/live/start_recording.hpp"

#include <filesystem>
#include <fstream>

#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/robot_setup.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

TEST(LoneAnchor, MustBeGivenIfAndOnlyIfTheWorldIsUnknown) {
  const RobotSetup simulated = load_setup("circuit24", "", 1).value();
  RobotSetup process = load_setup("", "limo", 1).value();
  process.process = "true";
  RobotSetup known = simulated;
  known.process = "true";
  for (RobotSetup setup : {simulated, known}) {
    EXPECT_TRUE(place_lone_anchor(setup, {}));
    EXPECT_FALSE(place_lone_anchor(setup, {.anchor = "0"}));
    EXPECT_FALSE(place_lone_anchor(setup, {.tag_size_m = 0.16}));
  }
  EXPECT_FALSE(place_lone_anchor(process, {}));
  EXPECT_FALSE(place_lone_anchor(process, {.anchor = "0"}));
  EXPECT_FALSE(place_lone_anchor(process, {.tag_size_m = 0.16}));
  EXPECT_FALSE(place_lone_anchor(process, {.anchor = "no tag", .tag_size_m = 0.16}));
  ASSERT_TRUE(place_lone_anchor(process, {.anchor = "7", .tag_size_m = 0.16}));
  const World& world = process.simulated.world;
  EXPECT_EQ(to_string(world.anchor), "tag36h11:7");
  ASSERT_NE(world.tags.find(world.anchor), nullptr);
  EXPECT_EQ(world.tags.find(world.anchor)->size_m, 0.16);
}

TEST(LoneAnchor, DefaultsToTheAnchorOfAnExistingMap) {
  RobotSetup setup = load_setup("", "limo", 1).value();
  setup.process = "true";
  const fs::path none = testing::fresh_folder("lone_anchor");
  EXPECT_TRUE(place_lone_anchor(setup, {}, none.string())) << "the code that loads the map reports the error";
  EXPECT_FALSE(place_lone_anchor(setup, {}, "")) << "without a map, the anchor must be specified";
  ASSERT_TRUE(place_lone_anchor(setup, {.anchor = "3", .tag_size_m = 0.1}, none.string()));
  EXPECT_EQ(to_string(setup.simulated.world.anchor), "tag36h11:3");
}

TEST(StartRecording, NeverOverwritesAFile) {
  const fs::path folder = testing::fresh_folder("start_recording");
  const auto at = [&](const char* name) { return (folder / name).string(); };
  const auto setup = load_setup("circuit24", "limo", 1);
  ASSERT_TRUE(setup) << to_string(setup.error());
  std::ofstream(folder / "lap.mcap") << "older";
  const auto recorder = start_recording(at("lap.mcap"), {.verb = "test", .driver = "none"}, *setup);
  ASSERT_FALSE(recorder);
  EXPECT_EQ(recorder.error().place.source, at("lap.mcap"));
  auto fresh = start_recording(at("new.mcap"), {.verb = "test", .driver = "none"}, *setup);
  ASSERT_TRUE(fresh) << to_string(fresh.error());
  EXPECT_TRUE(fresh->close());
  EXPECT_GT(fs::file_size(at("new.mcap")), 1000U) << "contains its metadata before any sample";
}

}  // namespace
}  // namespace waymark
