#include "waymark/app/teach/teach_lap.hpp"

#include <fstream>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "waymark/app/calibrate_camera/calibrate_guided.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/replay/replay_route.hpp"
#include "waymark/app/session/explore_world.hpp"
#include "waymark/app/session/run_demo.hpp"
#include "waymark/app/session/run_session.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::string words(const Status& status) { return status ? "" : to_string(status.error()); }

TEST(TeachChecks, SpeedsAreThoseOfTheRobotAndOfItsDriver) {
  RobotSetup setup = load_setup("circuit24", "limo", 1).value();
  EXPECT_EQ(words(check_teach({.output = "a.mcap"}, setup)), "");
  EXPECT_THAT(words(check_teach({.output = "a.mcap", .speed_m_s = 4}, setup)),
              StartsWith("(--speed-m-s): limo drives at most "));
  EXPECT_THAT(words(check_teach({.output = "a.mcap", .second_speed_m_s = 4}, setup)),
              StartsWith("(--second-speed-m-s): limo drives at most "));
  EXPECT_EQ(words(check_teach({.output = "a.mcap", .second_speed_m_s = 0.5}, setup)), "");
  EXPECT_THAT(words(check_teach({.output = "a.mcap", .driver = "keyboard", .second_speed_m_s = 0.5}, setup)),
              HasSubstr("only the scripted driver"));
  EXPECT_EQ(words(check_teach({.output = "a.mcap", .images = "jpeg"}, setup)),
            "(--record-images): there are no pictures to record. Add --images.");
  setup.process = RobotCommand("true");
  EXPECT_EQ(words(check_teach({.output = "a.mcap", .images = "jpeg"}, setup)), "") << "it may have some";
}

TEST(TeachChecks, TheNearestDriverIsNamed) {
  EXPECT_EQ(words(check_lap_driver("keyboard")), "");
  EXPECT_EQ(words(check_lap_driver("keybord")),
            "(--driver): there is no driver 'keybord'. Did you mean 'keyboard'?");
}

TagId tag(int number) { return parse_tag_id("tag36h11:" + std::to_string(number)).value(); }

TEST(TeachReportText, NamesTheTagThatWasSeenLeastAndTheNextCommand) {
  TeachReport report;
  report.summary.seen = {{tag(3), 40}, {tag(7), 4}};
  report.summary.mappable = true;
  const std::string text = to_text(report, "lap.mcap", true);
  EXPECT_THAT(text, HasSubstr("Every tag was seen in 4 frames or more (tag36h11:7 in fewest)."));
  EXPECT_THAT(text, HasSubstr("The loop is not closed."));
  EXPECT_THAT(text, HasSubstr("waymark map lap.mcap -o map"));
}

TEST(TeachReportText, SaysNothingOfALoopWhereTheRouteIsOpenAndNothingOfTagsWhereNoneWasSeen) {
  const std::string text = to_text(TeachReport{}, "lap.mcap", false);
  EXPECT_THAT(text, Not(HasSubstr("loop")));
  EXPECT_THAT(text, Not(HasSubstr("in fewest")));
  EXPECT_THAT(text, HasSubstr("nothing to make a map of"));
}

TEST(TeachReportJson, HoldsWeakLinksByTheirTags) {
  TeachReport report;
  report.summary.weak_links = {{.first = tag(1), .second = tag(2), .frames = 2}};
  const auto json = to_json(report, "lap.mcap");
  EXPECT_EQ(json["file"], "lap.mcap");
  ASSERT_EQ(json["weak_links"].size(), 1U);
  EXPECT_EQ(json["weak_links"][0]["tags"][1], "tag36h11:2");
  EXPECT_EQ(json["weak_links"][0]["frames"], 2);
}

}  // namespace
}  // namespace waymark
