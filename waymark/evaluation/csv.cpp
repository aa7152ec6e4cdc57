#include "waymark/evaluation/csv.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

namespace waymark {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// Removes a quoted cell from the front of `rest` (which starts with the quote); `nullopt` if the quote is
/// not closed.
std::optional<std::string> take_quoted(std::string_view& rest) {
  std::string cell;
  for (std::size_t i = 1; i < rest.size(); ++i) {
    if (rest[i] != '"') {
      cell += rest[i];
    } else if (i + 1 < rest.size() && rest[i + 1] == '"') {
      cell += '"';
      ++i;
    } else {
      rest.remove_prefix(i + 1);
      return cell;
    }
  }
  return std::nullopt;
}

/// The cells in one line; `nullopt` if a quote is not closed or text follows a closing quote.
std::optional<std::vector<std::string>> split(std::string_view line) {
  std::vector<std::string> cells;
  for (std::string_view rest = line;;) {
    rest = trimmed(rest);
    if (rest.starts_with('"')) {
      auto cell = take_quoted(rest);
      rest = trimmed(rest);
      if (!cell || !(rest.empty() || rest.front() == ',')) return std::nullopt;
      cells.push_back(std::move(*cell));
    } else {
      const std::string_view cell = rest.substr(0, rest.find(','));
      cells.emplace_back(trimmed(cell));
      rest.remove_prefix(cell.size());
    }
    if (rest.empty()) return cells;
    rest.remove_prefix(1);
  }
}

Status add_line(CsvTable& table, std::int64_t number, std::string_view line) {
  const Place place{.source = table.source, .line = number};
  auto cells = split(line);
  if (!cells) {
    return fail(ErrorCode::Unreadable, "a quote is not closed, or text follows a closing quote", place,
                "Close it on the same line; write \"\" for a quote inside.");
  }
  if (table.columns.empty()) {
    table.columns = std::move(*cells);
    for (auto it = table.columns.begin(); it != table.columns.end(); ++it) {
      if (std::find(table.columns.begin(), it, *it) != it) {
        return fail(ErrorCode::InvalidArgument, fmt::format("duplicate column '{}'", *it), place);
      }
    }
    return {};
  }
  if (cells->size() != table.columns.size()) {
    return fail(ErrorCode::Unreadable,
                fmt::format("{} cells instead of {} as in the header", cells->size(), table.columns.size()),
                place, "Give each row one cell per column; cells of optional columns may be empty.");
  }
  table.rows.push_back({number, std::move(*cells)});
  return {};
}

Error bad_cell(const CsvTable& table, const CsvRow& row, std::size_t column, std::string_view wanted) {
  return {ErrorCode::InvalidArgument,
          fmt::format("'{}' is not {}", row.cells[column].substr(0, 40), wanted),
          {.source = table.source, .line = row.line, .key = table.columns[column]},
          {}};
}

}  // namespace

std::optional<std::size_t> CsvTable::column(std::string_view name) const {
  const auto found = std::find(columns.begin(), columns.end(), name);
  if (found == columns.end()) return std::nullopt;
  return static_cast<std::size_t>(found - columns.begin());
}

Result<CsvTable> parse_csv(std::string_view text, std::string source) {
  CsvTable table;
  table.source = std::move(source);
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // spreadsheets write it at the start of a file
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  for (std::int64_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || line.front() == '#') continue;
    if (auto added = add_line(table, number, line); !added) return tl::unexpected(added.error());
  }
  if (table.columns.empty()) {
    return fail(ErrorCode::Unreadable, "no header line", {.source = table.source},
                "Put the column names into the first line.");
  }
  return table;
}

Result<double> csv_number(const CsvTable& table, const CsvRow& row, std::size_t column) {
  const std::string& cell = row.cells[column];
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value)) {
    return tl::unexpected(bad_cell(table, row, column, "a finite number"));
  }
  return value;
}

Result<int> csv_integer(const CsvTable& table, const CsvRow& row, std::size_t column) {
  const std::string& cell = row.cells[column];
  int value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size()) {
    return tl::unexpected(bad_cell(table, row, column, "a whole number"));
  }
  return value;
}

}  // namespace waymark
