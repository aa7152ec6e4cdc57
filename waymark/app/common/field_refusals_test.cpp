#include "waymark/app/common/field_refusals.hpp"

#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/app/localize/localize_log.hpp"
#include "waymark/app/map/map_recording.hpp"

namespace waymark {
namespace {

GivenFields given(std::set<std::string> fields) {
  return [fields = std::move(fields)](const char* field) { return fields.contains(field); };
}

TEST(FieldRefusals, ReportsTheFirstFieldThatWasGiven) {
  FieldRefusals refused(given({"to", "view"}));
  refused.fields(true, {"from"}, "nothing to cut", "");
  EXPECT_TRUE(refused.status());
  refused.fields(false, {"to"}, "nothing to cut", "");
  EXPECT_TRUE(refused.status());
  refused.fields(true, {"from", "to"}, "nothing to cut", "Omit it.");
  refused.fields(true, {"view"}, "no page is shown", "");
  ASSERT_FALSE(refused.status());
  EXPECT_EQ(refused.status().error().place.key, "to");
  EXPECT_EQ(refused.status().error().message, "nothing to cut");
  EXPECT_EQ(refused.status().error().hint, "Omit it.");
}

TEST(JobFields, AreNamedOnce) {
  for (const auto& names : {field_names<MapJob>(), field_names<LocalizeJob>()}) {
    const std::set<std::string> once(names.begin(), names.end());
    EXPECT_EQ(once.size(), names.size());
    EXPECT_THAT(names, ::testing::Contains("camera_frame")) << "fields of nested structs are included";
  }
}

}  // namespace
}  // namespace waymark
