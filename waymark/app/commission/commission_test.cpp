// Tests the JSON report of a first drive.
#include "waymark/app/commission/commission.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

TEST(CommissionReport, HasAnEntryPerFindingAndOnlyMeasuredFigures) {
  EXPECT_EQ(to_json(fields(CommissionReport{})).dump(),
            R"({"passed":false,"interrupted":false,"simulated":false,"file":"","kept":"","figures":{},)"
            R"("findings":[]})");
  CommissionReport report{.figures = {.response_s = 0.2, .yaw_rate_scale = 1}, .real = false};
  report.findings = {{"stops", {"stop.kill", CommissionVerdict::Fail, "did not stop", "the watchdog"}}};
  const auto json = to_json(fields(report));
  EXPECT_EQ(json["simulated"], true);
  EXPECT_EQ(json["figures"].dump(), R"({"response_s":0.2,"yaw_rate_scale":1.0})");
  ASSERT_EQ(json["findings"].size(), 1U);
  EXPECT_EQ(
      json["findings"][0].dump(),
      R"({"step":"stops","check":"stop.kill","level":"fail","message":"did not stop","remedy":"the watchdog"})");
}

}  // namespace
}  // namespace waymark
