#include "waymark/base/json_depth.hpp"

#include <string>

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(JsonDepth, CountsListsAndObjectsOutsideStrings) {
  EXPECT_EQ(json_depth("", 9), 0U);
  EXPECT_EQ(json_depth("17", 9), 0U);
  EXPECT_EQ(json_depth(R"({"a":[1,[2],{}]})", 9), 3U);
  EXPECT_EQ(json_depth(R"(["[[[[", "\"[[", "\\"])", 9), 1U);
  EXPECT_EQ(json_depth("[][][]", 9), 1U);
  EXPECT_EQ(json_depth("]]]]{", 9), 1U);
  EXPECT_EQ(json_depth(R"("ends in the text \)", 9), 0U);
}

TEST(JsonDepth, CountingStopsBeyondTheLimit) { EXPECT_EQ(json_depth(std::string(10'000'000, '['), 16), 17U); }

}  // namespace
}  // namespace waymark
