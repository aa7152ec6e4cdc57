#include "waymark/evaluation/csv.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string failure(std::string_view text) {
  const auto table = parse_csv(text, "t.csv");
  return table ? "parsed" : to_string(table.error());
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

TEST(Csv, SaysWhereItIsBroken) {
  EXPECT_THAT(failure(""), HasSubstr("t.csv: no header line"));
  EXPECT_THAT(failure("# only a remark\n"), HasSubstr("no header line"));
  EXPECT_THAT(failure("a,b\n1,2\n3\n"), HasSubstr("t.csv:3: 1 cells where the header names 2 columns"));
  EXPECT_THAT(failure("a,b\n1,2,\n"), HasSubstr("t.csv:2: 3 cells"));
  EXPECT_THAT(failure("a,b,a\n"), HasSubstr("t.csv:1: column 'a' is named twice"));
  EXPECT_THAT(failure("a\n\"open\n"), HasSubstr("t.csv:2: a quote is not closed"));
  EXPECT_THAT(failure("a\n\"x\"y\n"), HasSubstr("t.csv:2: a quote is not closed, or text follows"));
}

TEST(Csv, NumbersAreFiniteAndWhole) {
  const auto table = parse_csv("v\n1.5\n-2\n1e999\nnan\n1.5x\n\n\"\"\n99999999999\n", "t.csv");
  ASSERT_TRUE(table);
  ASSERT_EQ(table->rows.size(), 7U);
  EXPECT_EQ(csv_number(*table, table->rows[0], 0).value(), 1.5);
  EXPECT_EQ(csv_integer(*table, table->rows[1], 0).value(), -2);
  EXPECT_EQ(to_string(csv_integer(*table, table->rows[0], 0).error()),
            "t.csv:2 (v): '1.5' is not a whole number");
  for (const std::size_t row : {2U, 3U, 4U, 5U}) EXPECT_FALSE(csv_number(*table, table->rows[row], 0)) << row;
  EXPECT_FALSE(csv_integer(*table, table->rows[6], 0));
}

TEST(Csv, WhatIsQuotedComesBack) {
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

TEST(Csv, AnyTextIsReadOrRefused) {
  rc::check("no text crashes, and what is read is rectangular", [](const std::string& text) {
    const auto table = parse_csv(text, "t.csv");
    if (!table) return;
    for (const CsvRow& row : table->rows) RC_ASSERT(row.cells.size() == table->columns.size());
  });
}

}  // namespace
}  // namespace waymark
