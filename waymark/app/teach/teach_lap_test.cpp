#include "waymark/app/teach/teach_lap.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/app/common/profile_table.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/app/replay/replay_route.hpp"
#include "waymark/app/session/run_session.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::string words(const Status& status) { return status ? "" : to_string(status.error()); }

/// The field named in an error; the golden page contains the full text.
std::string field_of(const Status& status) {
  if (status) return "";
  testing::expect_on_page("teach", status.error());
  return status.error().place.key;
}

TEST(TeachChecks, RefusesSpeedsBeyondRobotAndDriver) {
  RobotSetup setup = load_setup("circuit24", "limo", 1).value();
  EXPECT_EQ(words(check_teach({.output = "a.mcap"}, setup)), "");
  EXPECT_EQ(field_of(check_teach({.output = "a.mcap", .speed_m_s = 4}, setup)), "speed_m_s");
  EXPECT_EQ(field_of(check_teach({.output = "a.mcap", .second_speed_m_s = 4}, setup)), "second_speed_m_s");
  EXPECT_EQ(words(check_teach({.output = "a.mcap", .second_speed_m_s = 0.5}, setup)), "");
  EXPECT_EQ(field_of(check_teach({.output = "a.mcap", .driver = "keyboard", .second_speed_m_s = 0.5}, setup)),
            "second_speed_m_s");
  EXPECT_EQ(field_of(check_teach({.output = "a.mcap", .images = "jpeg"}, setup)), "record_images");
  setup.process = RobotCommand("true");
  EXPECT_EQ(words(check_teach({.output = "a.mcap", .images = "jpeg"}, setup)), "")
      << "a process may send images";
}

TEST(TeachChecks, SuggestsTheNearestDriver) {
  EXPECT_EQ(words(check_lap_driver("keyboard")), "");
  const Status misspelt = check_lap_driver("keybord");
  EXPECT_EQ(field_of(misspelt), "driver");
  EXPECT_THAT(misspelt.error().message, HasSubstr("'keybord'"));
  EXPECT_THAT(misspelt.error().hint, HasSubstr("'keyboard'"));
}

TagId tag(int number) { return parse_tag_id("tag36h11:" + std::to_string(number)).value(); }

TEST(TeachReportText, NamesTheLeastObservedTagAndTheNextCommand) {
  TeachReport report;
  report.summary.seen = {{tag(3), 40}, {tag(7), 4}};
  report.summary.mappable = true;
  report.file = "lap.mcap";
  const std::string text = to_text(report, true);
  EXPECT_THAT(text, HasSubstr("4 frames"));
  EXPECT_THAT(text, HasSubstr("(tag36h11:7"));
  EXPECT_THAT(text, HasSubstr("`waymark map lap.mcap output=map`"));
  testing::expect_on_page("teach", text);
}

TEST(TeachReportText, HasNoLoopForAnOpenRouteAndNoCountsWithoutTags) {
  const std::string text = to_text(TeachReport{}, false);
  EXPECT_THAT(text, Not(HasSubstr("loop")));
  EXPECT_THAT(text, Not(HasSubstr("fewest")));
  testing::expect_on_page("teach", text);
}

TEST(TeachReportJson, ContainsWeakLinksByTheirTags) {
  TeachReport report{.file = "lap.mcap"};
  report.summary.weak_links = {{.first = tag(1), .second = tag(2), .frames = 2}};
  const auto json = to_json(fields(report));
  EXPECT_EQ(json["file"], "lap.mcap");
  ASSERT_EQ(json["weak_links"].size(), 1U);
  EXPECT_EQ(json["weak_links"][0]["tags"][1], "tag36h11:2");
  EXPECT_EQ(json["weak_links"][0]["frames"], 2);
}

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A control that cancels the job on the given call to cancelled().
JobControl cancelled_at_call(int call) {
  JobControl control;
  control.cancelled = [call, asked = 0]() mutable { return ++asked >= call; };
  return control;
}

/// Tests laps with a robot simulated in this process.
class TeachLap : public ::testing::Test {
 protected:
  [[nodiscard]] std::string lap(const char* name = "lap.mcap") const { return (folder_ / name).string(); }

  const fs::path folder_ =
      testing::fresh_folder(::testing::UnitTest::GetInstance()->current_test_info()->name());
  const RobotSetup setup_ = load_setup("circuit24", "", 1).value();
};

TEST_F(TeachLap, TheBytesOfTheRecordingDependOnTheSeed) {
  const auto first = teach_lap(setup_, {.output = lap()}, {});
  ASSERT_TRUE(first) << to_string(first.error());
  EXPECT_TRUE(first->end.finished);
  EXPECT_TRUE(first->summary.closed_loop);
  EXPECT_TRUE(first->summary.mappable);
  ASSERT_TRUE(teach_lap(setup_, {.output = lap("again.mcap")}, {}));
  ASSERT_TRUE(teach_lap(load_setup("circuit24", "", 2).value(), {.output = lap("other.mcap")}, {}));
  EXPECT_EQ(bytes_of(lap()), bytes_of(lap("again.mcap")));
  EXPECT_NE(bytes_of(lap()), bytes_of(lap("other.mcap")));
}

TEST_F(TeachLap, ACancelledLapIsClosedAndCanBeRead) {
  const auto taught = teach_lap(setup_, {.output = lap()}, cancelled_at_call(400));
  ASSERT_TRUE(taught) << to_string(taught.error());
  EXPECT_FALSE(taught->end.finished);
  EXPECT_TRUE(taught->end.interrupted);
  EXPECT_GT(taught->summary.frames, 0);
  const auto profile = profile_of(lap(), {});
  ASSERT_TRUE(profile) << to_string(profile.error());
  EXPECT_NEAR(profile->duration_s, taught->end.lap_s, 1.0);
}

TEST_F(TeachLap, ADriveThatCannotBeginLeavesNoFile) {
  const auto driver = teach_lap(setup_, {.output = lap(), .driver = "autopilot"}, {});
  ASSERT_FALSE(driver);
  EXPECT_THAT(driver.error().message, HasSubstr("autopilot"));
  EXPECT_FALSE(fs::exists(lap()));
  EXPECT_FALSE(teach_lap(setup_, {.output = (folder_ / "missing/lap.mcap").string()}, {}));
}

}  // namespace
}  // namespace waymark
