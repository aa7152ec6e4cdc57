#include "waymark/app/session/explore_world.hpp"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "waymark/app/session/run_demo.hpp"
#include "waymark/app/session/run_session.hpp"
#include "waymark/app/teach/teach_lap.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

TEST(ExploreReportText, APlaceThatWasNeverKnownHasNoErrors) {
  ExploreReport report{.seconds = 60, .tags = 8};
  report.nearest_m = std::numeric_limits<double>::infinity();
  const std::string text = to_text(report);
  EXPECT_THAT(text, HasSubstr("the place was never known"));
  EXPECT_THAT(text, HasSubstr("nothing in this world to come near to"));
  EXPECT_TRUE(to_json(report)["position_rmse_m"].is_null());
}

TEST(ExploreReportText, ErrorsAreThoseByTheTruth) {
  ExploreReport report{.nearest_m = 0.25, .certain_fraction = 0.5};
  report.position_rmse_m = 0.01;
  report.position_p95_m = 0.02;
  report.position_max_m = 0.03;
  report.heading_rmse_deg = 0.4;
  const std::string text = to_text(report);
  EXPECT_THAT(text, HasSubstr("0.010 m rmse, 0.020 m 95 %, 0.030 m worst"));
  EXPECT_THAT(text, HasSubstr("0.250 m from the hull"));
  EXPECT_THAT(text, HasSubstr("50.0 % of the time"));
  EXPECT_EQ(to_json(report)["heading_rmse_deg"], 0.4);
}

}  // namespace
}  // namespace waymark
