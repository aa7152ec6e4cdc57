// Errors as JSON, words of a shell, and prints of boards and sheets in words.
#include "waymark/app/common/json_line.hpp"

#include <algorithm>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/tags/tag_prints.hpp"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(JsonLine, AnErrorHasOnlyWhatIsKnownOfItsPlace) {
  const auto bare = to_json(Error{ErrorCode::NotFound, "no map"});
  EXPECT_EQ(bare.dump(), R"({"code":"not_found","message":"no map"})");
  const auto whole = to_json(Error{ErrorCode::Unreadable,
                                   "cut",
                                   {.source = "a.mcap", .line = 3, .byte = 70'000'000'000, .key = "x.y"},
                                   "Record again."});
  EXPECT_EQ(whole["source"], "a.mcap");
  EXPECT_EQ(whole["line"], 3);
  EXPECT_EQ(whole["byte"], 70'000'000'000);
  EXPECT_EQ(whole["key"], "x.y");
  EXPECT_EQ(whole["hint"], "Record again.");
}

TEST(JsonLine, IsOneLineWhateverItHolds) {
  const std::string hostile = std::string("a\nb\"\\\t") + '\xff' + "\xc3\x28" + '\0' + "end";
  const std::string line = json_line({{"name", hostile}});
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
  EXPECT_EQ(line.back(), '\n');
  const auto read = nlohmann::json::parse(line);
  EXPECT_THAT(read["name"].get<std::string>(),
              AllOf(HasSubstr("a\nb\"\\\t"), HasSubstr("\xEF\xBF\xBD"), HasSubstr("end")));
}

/// What the shell makes of a word.
std::string echoed(const std::string& word) {
  const std::string command = "printf %s " + word;
  std::FILE* pipe = ::popen(command.c_str(), "r");
  EXPECT_NE(pipe, nullptr);
  std::string text;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += static_cast<char>(c);
  EXPECT_EQ(::pclose(pipe), 0) << command;
  return text;
}

TEST(ShellWord, IsWhatTheShellReadsBack) {
  for (const std::string word : {"lap.mcap", "my lap.mcap", "it's", "a$HOME`ls`", "\"quoted\"", "*?[a]",
                                 "a\\b", "#x", "~", "a;b|c&d", "(x)", "-n", "it's 'two'", "a\nb", "!x"})
    EXPECT_EQ(echoed(shell_word(word)), word);
  EXPECT_EQ(shell_word("out/lap-1.mcap"), "out/lap-1.mcap") << "plain names stay plain";
  EXPECT_EQ(shell_word(""), "''");
}

TEST(Stopwatch, GoesForwardAndMemoryIsUsed) {
  const Stopwatch watch;
  const double first = watch.seconds();
  EXPECT_GE(first, 0);
  EXPECT_GE(watch.seconds(), first);
  EXPECT_LT(first, 10);
  EXPECT_GT(peak_rss_mib(), 1);
}

TEST(TagPrints, ASheetIsCountedByPagesAndTags) {
  const auto layout =
      plot::layout_sheet(FamilyId::Tag36h11, {0, 1, 2, 3, 4}, {.tag_size_m = 0.1, .per_page = 2});
  ASSERT_TRUE(layout) << to_string(layout.error());
  const std::vector<std::string> files = {"tags-1.svg", "tags-2.svg", "tags-3.svg"};
  EXPECT_THAT(to_text(*layout, files),
              AllOf(HasSubstr("tags-1.svg …: 3 pages A4, 2 tags a page"), HasSubstr("of 0.1 m")));
  const auto json = to_json(*layout, files);
  EXPECT_EQ(json["pages"], 3);
  EXPECT_EQ(json["tags"], 5);
  EXPECT_EQ(json["files"].size(), 3U);
  const auto one = plot::layout_sheet(FamilyId::Tag36h11, {7}, {.tag_size_m = 0.15});
  ASSERT_TRUE(one);
  EXPECT_THAT(to_text(*one, {"tag.pdf"}), HasSubstr("tag.pdf: 1 page A4, 1 tag a page"));
}

TEST(TagPrints, ABoardNamesItsTargetFile) {
  const auto layout = plot::layout_board({.columns = 4, .rows = 3, .tag_size_m = 0.03});
  ASSERT_TRUE(layout) << to_string(layout.error());
  EXPECT_THAT(
      to_text(*layout, {"board.pdf", "board.yaml"}),
      AllOf(HasSubstr("aprilgrid board of 4 x 3 tags"), HasSubstr("board.yaml: the target file for Kalibr")));
  const auto json = to_json(*layout, {"board.pdf"});
  EXPECT_EQ(json["tags"], 12);
  EXPECT_EQ(json["paper_size_m"][0].get<double>() + json["paper_size_m"][1].get<double>(), 0.507);
}

TEST(TagPrints, AChessboardHasNoMarkers) {
  CalibrationBoard board{.kind = BoardKind::Chessboard, .columns = 6, .rows = 5, .size_m = 0.03};
  const auto none = printed_markers(board);
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->empty());
  const auto layout = plot::layout_square_board({.board = board});
  ASSERT_TRUE(layout) << to_string(layout.error());
  const auto json = to_json(*layout, {"board.pdf"});
  EXPECT_FALSE(json.contains("dictionary"));
  EXPECT_EQ(json["square_size_m"], 0.03);
  EXPECT_THAT(to_text(*layout, {"board.pdf"}), HasSubstr("chessboard of 6 x 5 squares of 0.03 m, 1 page A4"));
}

}  // namespace
}  // namespace waymark
