#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// One line of a table, cell by cell.
struct CsvRow {
  std::int64_t line = 0;  ///< 1-based line in the text
  std::vector<std::string> cells;
};

/// A table whose first line names the columns. Every row has as many cells as there are columns.
struct CsvTable {
  std::string source;  ///< file path or other name, for messages
  std::vector<std::string> columns;
  std::vector<CsvRow> rows;

  [[nodiscard]] std::optional<std::size_t> column(std::string_view name) const;
};

/// Parses comma-separated text (RFC 4180 without line breaks inside quotes). Blank lines and lines that start
/// with '#' are skipped, blanks around a cell are dropped, LF and CRLF both end a line. Fails, with the line,
/// on text without a header, a column named twice, a row of another length, an open quote. O(text).
[[nodiscard]] Result<CsvTable> parse_csv(std::string_view text, std::string source);

/// The finite number in a cell; the error says line, column and what stands there.
[[nodiscard]] Result<double> csv_number(const CsvTable& table, const CsvRow& row, std::size_t column);

/// The integer in a cell; the error says line, column and what stands there.
[[nodiscard]] Result<int> csv_integer(const CsvTable& table, const CsvRow& row, std::size_t column);

}  // namespace waymark
