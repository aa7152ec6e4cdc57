#include "waymark/config/text_file.hpp"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

TEST(TextFile, ComesBackAsWritten) {
  const auto path = testing::fresh_folder("text") / "a.yaml";
  const std::string text("a: 1\r\nb: \0\xff", 11);
  ASSERT_TRUE(write_text_file(path, text));
  ASSERT_TRUE(write_text_file(path, text)) << "replaces";
  EXPECT_EQ(*read_file(path, 11), text);
  EXPECT_EQ(read_text_file(path, 11).error().place.source, path.string());
  testing::expect_on_page("config", read_text_file(path, 11).error());
  EXPECT_EQ(read_file(path, 10).error().code, ErrorCode::LimitExceeded);
  testing::expect_on_page("config", read_file(path, 10).error());
}

TEST(TextFile, ReportsInvalidPaths) {
  const auto folder = testing::fresh_folder("text");
  EXPECT_EQ(read_text_file(folder / "none", 10).error().code, ErrorCode::NotFound);
  testing::expect_on_page("config", read_text_file(folder / "none", 10).error());
  EXPECT_EQ(read_text_file(folder, 10).error().code, ErrorCode::Unreadable);
  testing::expect_on_page("config", read_text_file(folder, 10).error());
  EXPECT_EQ(write_text_file(folder / "no" / "where", "x").error().code, ErrorCode::Unwritable);
  EXPECT_EQ(write_text_file(folder, "x").error().code, ErrorCode::Unwritable);
  EXPECT_FALSE(std::filesystem::exists(folder.string() + ".tmp")) << "no temporary file remains";
}

}  // namespace
}  // namespace waymark
