#include "waymark/app/session/run_demo.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(DemoReportText, HasRowsOnlyForAvailableComparisons) {
  DemoReport report;
  EXPECT_THAT(to_text(report), Not(HasSubstr("rmse")));
  report.replay.judgement = ReplayJudgement{};
  report.replay.judgement->laps_completed = 2;
  EXPECT_THAT(to_text(report), HasSubstr("laps completed"));
  EXPECT_THAT(to_text(report), HasSubstr("cross-track error, rmse"));
  testing::expect_on_page("session", to_text(report));
}

TEST(DemoReportJson, HoldsTheReportsOfTheThreeSteps) {
  const DemoReport report{.teach = {.file = "demo/lap.mcap"}, .figures = {"demo/map_error.svg"}, .wall_s = 2};
  const auto json = to_json(fields(report));
  EXPECT_EQ(json["teach"]["file"], "demo/lap.mcap");
  EXPECT_EQ(json["map"], to_json(fields(report.map)));
  EXPECT_EQ(json["replay"], to_json(fields(report.replay)));
  EXPECT_EQ(json["figures"][0], "demo/map_error.svg");
  EXPECT_EQ(json["wall_s"], 2.0);
  EXPECT_EQ(json.size(), 5U);
}

TEST(DemoFolder, ADemoOverwritesOnlyItsOwnFiles) {
  const fs::path folder = testing::fresh_folder("demo_folder");
  const auto at = [&](const char* name) { return (folder / name).string(); };
  const auto put = [&](const std::string& name, const std::string& text) {
    fs::create_directories((folder / name).parent_path());
    std::ofstream(folder / name, std::ios::binary) << text;
  };
  ASSERT_TRUE(clear_demo_folder(at("demo")));
  put("demo/lap.mcap", "of the last demo");
  ASSERT_TRUE(clear_demo_folder(at("demo")));
  EXPECT_FALSE(fs::exists(at("demo/lap.mcap"))) << "removed, so that a new one can be recorded";
  put("mine/lap.mcap", "not of a demo");
  const Status mine = clear_demo_folder(at("mine"));
  ASSERT_FALSE(mine);
  EXPECT_THAT(mine.error().message, HasSubstr("'lap.mcap'"));
  EXPECT_EQ(mine.error().place.source, at("mine"));
  testing::expect_on_page("session", mine.error());
  EXPECT_TRUE(fs::exists(at("mine/lap.mcap")));
}

}  // namespace
}  // namespace waymark
