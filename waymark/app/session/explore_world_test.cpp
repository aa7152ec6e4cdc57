#include "waymark/app/session/explore_world.hpp"

#include <filesystem>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/app/session/run_session.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(ExploreReportText, HasNoErrorsIfThePoseWasNeverCertain) {
  ExploreReport report{.seconds = 60, .tags = 8};
  report.nearest_m = std::numeric_limits<double>::infinity();
  const std::string text = to_text(report);
  EXPECT_THAT(text, Not(HasSubstr("rmse")));
  testing::expect_on_page("session", text);
  const auto json = to_json(fields(report));
  EXPECT_TRUE(json["position_rmse_m"].is_null());
  EXPECT_TRUE(json["nearest_m"].is_null());
}

TEST(ExploreReportText, HasErrorsAgainstGroundTruth) {
  ExploreReport report{.nearest_m = 0.25, .certain_fraction = 0.5};
  report.position_rmse_m = 0.01;
  report.position_p95_m = 0.02;
  report.position_max_m = 0.03;
  report.heading_rmse_deg = 0.4;
  const std::string text = to_text(report);
  for (const char* part : {"0.010 m rmse", "0.020 m", "0.030 m", "0.250 m", "50.0 %"})
    EXPECT_THAT(text, HasSubstr(part));
  testing::expect_on_page("session", text);
  EXPECT_EQ(to_json(fields(report))["heading_rmse_deg"], 0.4);
}

/// A control that cancels the job on the given call to cancelled().
JobControl cancelled_at_call(int call) {
  JobControl control;
  control.cancelled = [call, asked = 0]() mutable { return ++asked >= call; };
  return control;
}

TEST(Explore, ADriveHasNoCollisionsAndEndsWhenCancelled) {
  const std::filesystem::path folder = testing::fresh_folder("explore_world");
  const RobotSetup house = load_setup("academy-house", "", 4).value();
  const auto walk = explore_world(house, {.minutes = 0.5, .output = (folder / "walk.mcap").string()}, {});
  ASSERT_TRUE(walk) << to_string(walk.error());
  EXPECT_FALSE(walk->interrupted);
  EXPECT_NEAR(walk->seconds, 30, 0.5);
  EXPECT_EQ(walk->collisions, 0);
  EXPECT_GT(walk->distance_m, 1);
  const auto ended = explore_world(house, {.minutes = 0.5}, cancelled_at_call(200));
  ASSERT_TRUE(ended) << to_string(ended.error());
  EXPECT_TRUE(ended->interrupted);
  EXPECT_LT(ended->seconds, walk->seconds);
  EXPECT_FALSE(explore_world(house, {.map = (folder / "no-map").string()}, {}));
}

}  // namespace
}  // namespace waymark
