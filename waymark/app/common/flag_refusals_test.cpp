#include "waymark/app/common/flag_refusals.hpp"

#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/app/localize/localize_log.hpp"
#include "waymark/app/map/map_recording.hpp"

namespace waymark {
namespace {

GivenFlags given(std::set<std::string> fields) {
  return [fields = std::move(fields)](const char* field) { return fields.contains(field); };
}

TEST(FlagRefusals, TheFirstThatWasGivenIsTheError) {
  FlagRefusals refused(given({"to", "view"}));
  refused.flags(true, {"from"}, "nothing to cut", "");
  EXPECT_TRUE(refused.status());
  refused.flags(false, {"to"}, "nothing to cut", "");
  EXPECT_TRUE(refused.status());
  refused.flags(true, {"from", "to"}, "nothing to cut", "Leave it out.");
  refused.flags(true, {"view"}, "nobody looks", "");
  ASSERT_FALSE(refused.status());
  EXPECT_EQ(refused.status().error().place.key, "to");
  EXPECT_EQ(refused.status().error().message, "nothing to cut");
  EXPECT_EQ(refused.status().error().hint, "Leave it out.");
}

TEST(JobFields, AreNamedOnce) {
  for (const auto& names : {field_names<MapJob>(), field_names<LocalizeJob>()}) {
    const std::set<std::string> once(names.begin(), names.end());
    EXPECT_EQ(once.size(), names.size());
    EXPECT_THAT(names, ::testing::Contains("camera_frame")) << "those of the structs in it are its own";
  }
}

}  // namespace
}  // namespace waymark
