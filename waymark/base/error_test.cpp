#include "waymark/base/error.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(Error, TextHasPlaceMessageAndHint) {
  const Error error{ErrorCode::InvalidArgument,
                    "negative focal length -3",
                    {.source = "cam.yaml", .line = 12, .key = "fx"},
                    "Give a value in pixels greater than 0."};
  EXPECT_EQ(to_string(error),
            "cam.yaml:12 (fx): negative focal length -3. Give a value in pixels greater than 0.");
  EXPECT_EQ(to_string(Error{ErrorCode::Unreadable, "cut short", {.source = "a.png", .byte = 7}}),
            "a.png at byte 7: cut short");
  EXPECT_EQ(to_string(Error{ErrorCode::NotFound, "nothing here"}), "nothing here");
}

TEST(Error, ResultChains) {
  const Result<int> two = 2;
  const Result<int> four = two.map([](int x) { return 2 * x; });
  ASSERT_TRUE(four);
  EXPECT_EQ(*four, 4);
  const Result<int> none = fail(ErrorCode::NotFound, "no");
  EXPECT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace waymark
