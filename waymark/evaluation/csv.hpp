#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// One row of a table.
struct CsvRow {
  std::int64_t line = 0;  ///< line number in the text, starting at 1
  std::vector<std::string> cells;
};

/// A table whose first line contains the column names. Every row has one cell per column.
struct CsvTable {
  std::string source;  ///< file path or another name, for messages
  std::vector<std::string> columns;
  std::vector<CsvRow> rows;

  [[nodiscard]] std::optional<std::size_t> column(std::string_view name) const;
};

/// Parses comma-separated text (RFC 4180 without line breaks inside quotes). Blank lines and lines that start
/// with '#' are skipped, and blanks around a cell are removed. Lines end with LF or CRLF. Fails if the header
/// is missing, a column is duplicated, a row has a different length, or a quote is not closed; the error
/// contains the line. O(text).
[[nodiscard]] Result<CsvTable> parse_csv(std::string_view text, std::string source);

/// The finite number in a cell; errors contain the line, the column and the cell.
[[nodiscard]] Result<double> csv_number(const CsvTable& table, const CsvRow& row, std::size_t column);

/// The integer in a cell; errors contain the line, the column and the cell.
[[nodiscard]] Result<int> csv_integer(const CsvTable& table, const CsvRow& row, std::size_t column);

}  // namespace waymark
