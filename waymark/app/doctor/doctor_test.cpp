#include "waymark/app/doctor/doctor.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

TEST(DoctorText, HasALinePerCheckFollowedByItsCommand) {
  const DoctorReport report{{{"disk", DoctorLevel::Ok, "80 GB are free", ""},
                             {"camera", DoctorLevel::Warn, "in use", "fuser /dev/video0"}}};
  const std::string text = to_text(report);
  EXPECT_EQ(std::ranges::count(text, '\n'), 3);
  EXPECT_THAT(text, HasSubstr("warn  camera       in use\n                   fuser /dev/video0\n"));
  const json value = json(to_json(fields(report)));
  ASSERT_EQ(value["checks"].size(), report.checks.size());
  EXPECT_EQ(value["checks"][1]["level"], "warn");
  EXPECT_EQ(value["checks"][1]["command"], "fuser /dev/video0");
  EXPECT_FALSE(any_failed(report));
  EXPECT_TRUE(any_failed({{report.checks[0], {"robot", DoctorLevel::Fail, "is silent", ""}}}));
}

}  // namespace
}  // namespace waymark
