#include "waymark/evaluation/csv.hpp"

#include <cstdint>
#include <optional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Expects an error with its line (or without one if the optional is empty), and its text on the golden page.
void expect_error(const std::string& text, std::optional<std::int64_t> line) {
  const auto table = parse_csv(text, "t.csv");
  ASSERT_FALSE(table) << text;
  EXPECT_EQ(table.error().place.source, "t.csv");
  EXPECT_EQ(table.error().place.line, line) << text;
  testing::expect_on_page("evaluate", table.error());
}

TEST(Csv, ReadsColumnsRowsAndLines) {
  const auto table =
      parse_csv("\xEF\xBB\xBF# made by hand\r\na, b ,c\r\n1,2,3\r\n\r\n\"x,\"\"y\"\"\" ,,z", "t.csv");
  ASSERT_TRUE(table) << to_string(table.error());
  EXPECT_THAT(table->columns, ElementsAre("a", "b", "c"));
  ASSERT_EQ(table->rows.size(), 2U);
  EXPECT_THAT(table->rows[0].cells, ElementsAre("1", "2", "3"));
  EXPECT_EQ(table->rows[0].line, 3);
  EXPECT_THAT(table->rows[1].cells, ElementsAre("x,\"y\"", "", "z"));
  EXPECT_EQ(table->rows[1].line, 5);
  EXPECT_EQ(table->column("b"), 1U);
  EXPECT_EQ(table->column("B"), std::nullopt);
}

TEST(Csv, ReportsThePlaceOfAnError) {
  expect_error("", {});
  expect_error("# only a comment\n", {});
  expect_error("a,b\n1,2\n3\n", 3);
  expect_error("a,b\n1,2,\n", 2);
  expect_error("a,b,a\n", 1);
  expect_error("a\n\"open\n", 2);
  expect_error("a\n\"x\"y\n", 2);
}

TEST(Csv, NumbersAreFiniteAndWhole) {
  const auto table = parse_csv("v\n1.5\n-2\n1e999\nnan\n1.5x\n\n\"\"\n99999999999\n", "t.csv");
  ASSERT_TRUE(table);
  ASSERT_EQ(table->rows.size(), 7U);
  EXPECT_EQ(csv_number(*table, table->rows[0], 0).value(), 1.5);
  EXPECT_EQ(csv_integer(*table, table->rows[1], 0).value(), -2);
  const Error fraction = csv_integer(*table, table->rows[0], 0).error();
  EXPECT_EQ(fraction.place.line, 2);
  EXPECT_EQ(fraction.place.key, "v");
  EXPECT_THAT(fraction.message, HasSubstr("'1.5'"));
  testing::expect_on_page("evaluate", fraction);
  for (const std::size_t row : {2U, 3U, 4U, 5U}) EXPECT_FALSE(csv_number(*table, table->rows[row], 0)) << row;
  EXPECT_FALSE(csv_integer(*table, table->rows[6], 0));
}

TEST(Csv, QuotedTextIsPreserved) {
  rc::check("any text without line breaks survives quoting", [](const std::vector<std::string>& cells) {
    RC_PRE(!cells.empty());
    std::string names;
    std::string line;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      RC_PRE(cells[i].find('\n') == std::string::npos);
      std::string quoted;
      for (const char c : cells[i]) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
      names += (i == 0 ? "c" : ",c") + std::to_string(i);
      line += (i == 0 ? "\"" : ",\"") + quoted + "\"";
    }
    const auto table = parse_csv(names + "\n" + line + "\n", "t.csv");
    RC_ASSERT(table.has_value());
    RC_ASSERT(table->rows.size() == 1U);
    RC_ASSERT(table->rows[0].cells == cells);
  });
}

TEST(Csv, AnyTextIsParsedOrRejected) {
  rc::check("no text crashes the parser, and every table is rectangular", [](const std::string& text) {
    const auto table = parse_csv(text, "t.csv");
    if (!table) return;
    for (const CsvRow& row : table->rows) RC_ASSERT(row.cells.size() == table->columns.size());
  });
}

}  // namespace
}  // namespace waymark
