#include "waymark/config/text_file.hpp"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"

namespace waymark {
namespace {

TEST(TextFile, ComesBackAsWritten) {
  const auto path = testing::fresh_folder("text") / "a.yaml";
  const std::string text("a: 1\r\nb: \0\xff", 11);
  ASSERT_TRUE(write_text_file(path, text));
  ASSERT_TRUE(write_text_file(path, text)) << "replaces";
  EXPECT_EQ(*read_file(path, 11), text);
  EXPECT_EQ(to_string(read_text_file(path, 11).error()),
            path.string() +
                ": this is binary (it holds zero bytes), and no text. Give a text file here, in UTF-8.");
  EXPECT_EQ(to_string(read_file(path, 10).error()),
            path.string() + ": the file is longer than the 10 bytes allowed. Is this the right file?");
}

TEST(TextFile, SaysWhatIsWrongWithAPath) {
  const auto folder = testing::fresh_folder("text");
  EXPECT_EQ(to_string(read_text_file(folder / "none", 10).error()),
            (folder / "none").string() + ": there is no such file. Check the path.");
  EXPECT_EQ(to_string(read_text_file(folder, 10).error()),
            folder.string() + ": this is a folder. Give a file.");
  EXPECT_EQ(write_text_file(folder / "no" / "where", "x").error().code, ErrorCode::Unwritable);
  EXPECT_EQ(write_text_file(folder, "x").error().code, ErrorCode::Unwritable);
  EXPECT_FALSE(std::filesystem::exists(folder.string() + ".tmp")) << "nothing is left behind";
}

}  // namespace
}  // namespace waymark
