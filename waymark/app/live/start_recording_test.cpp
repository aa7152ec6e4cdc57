#include "waymark/app/live/start_recording.hpp"

#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/replay/robot_difference.hpp"
#include "waymark/app/robot/robot_table.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

TEST(LoneAnchor, IsGivenWhereNobodyKnowsTheWorldAndOnlyThere) {
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

TEST(LoneAnchor, OfAMapThatIsThereIsTheMapsUnlessOneIsGiven) {
  RobotSetup setup = load_setup("", "limo", 1).value();
  setup.process = "true";
  const fs::path none = testing::fresh_folder("lone_anchor");
  EXPECT_TRUE(place_lone_anchor(setup, {}, none.string())) << "said where the map is read";
  EXPECT_FALSE(place_lone_anchor(setup, {}, "")) << "no map: it must be given";
  ASSERT_TRUE(place_lone_anchor(setup, {.anchor = "3", .tag_size_m = 0.1}, none.string()));
  EXPECT_EQ(to_string(setup.simulated.world.anchor), "tag36h11:3");
}

}  // namespace
}  // namespace waymark
