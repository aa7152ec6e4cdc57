#include "waymark/app/session/run_demo.hpp"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "waymark/app/session/explore_world.hpp"
#include "waymark/app/session/run_session.hpp"
#include "waymark/app/teach/teach_lap.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(DemoReportText, HasRowsOnlyForWhatWasCompared) {
  DemoReport report;
  EXPECT_THAT(to_text(report), Not(HasSubstr("rmse")));
  report.replay.judgement = ReplayJudgement{};
  report.replay.judgement->laps_completed = 2;
  EXPECT_THAT(to_text(report), HasSubstr("laps completed"));
  EXPECT_THAT(to_text(report), HasSubstr("from the taught way, rmse"));
}

}  // namespace
}  // namespace waymark
