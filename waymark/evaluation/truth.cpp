#include "waymark/evaluation/truth.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/evaluation/csv.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

constexpr std::array<std::string_view, 8> kCorners = {"x0", "y0", "x1", "y1", "x2", "y2", "x3", "y3"};
constexpr std::array<std::string_view, 14> kKnown = {
    "image", "id", "x0", "y0", "x1", "y1", "x2", "y2", "x3", "y3", "size", "size_px", "tilt_deg", "family"};

/// Where the columns we read stand in the table.
struct Columns {
  std::size_t image = 0;
  std::size_t id = 0;
  std::array<std::size_t, 8> corners{};
  std::optional<std::size_t> size, tilt, family;
};

Result<std::size_t> required(const CsvTable& table, std::string_view name) {
  if (const auto found = table.column(name)) return *found;
  std::vector<std::string> unknown;  // a column we know is not the misspelling of another
  for (const std::string& column : table.columns) {
    if (std::find(kKnown.begin(), kKnown.end(), column) == kKnown.end()) unknown.push_back(column);
  }
  const std::string nearest = nearest_word(name, unknown);
  return fail(ErrorCode::NotFound, fmt::format("no column '{}'", name),
              {.source = table.source, .key = std::string(name)},
              (nearest.empty() ? "" : fmt::format("Did you mean '{}'? ", nearest)) +
                  "Needed: image, id, x0, y0, x1, y1, x2, y2, x3, y3.");
}

Result<Columns> find_columns(const CsvTable& table) {
  Columns columns;
  std::vector<std::pair<std::string_view, std::size_t*>> wanted = {{"image", &columns.image},
                                                                   {"id", &columns.id}};
  for (std::size_t i = 0; i < kCorners.size(); ++i) wanted.emplace_back(kCorners[i], &columns.corners[i]);
  for (const auto& [name, where] : wanted) {
    const auto found = required(table, name);
    if (!found) return tl::unexpected(found.error());
    *where = *found;
  }
  columns.size = table.column("size_px");
  if (!columns.size) columns.size = table.column("size");
  columns.tilt = table.column("tilt_deg");
  columns.family = table.column("family");
  return columns;
}

Result<std::optional<double>> optional_number(const CsvTable& table, const CsvRow& row,
                                              std::optional<std::size_t> column, double min, double max) {
  if (!column || row.cells[*column].empty()) return std::optional<double>();
  const auto value = csv_number(table, row, *column);
  if (!value) return tl::unexpected(value.error());
  if (*value < min || *value > max) {
    return fail(ErrorCode::InvalidArgument, fmt::format("{} is outside [{}, {}]", *value, min, max),
                {.source = table.source, .line = row.line, .key = table.columns[*column]});
  }
  return std::optional<double>(*value);
}

Result<TagId> read_tag(const CsvTable& table, const CsvRow& row, const Columns& columns) {
  const auto number = csv_integer(table, row, columns.id);
  if (!number) return tl::unexpected(number.error());
  TagId tag{.number = *number};
  if (columns.family && !row.cells[*columns.family].empty()) {
    auto id = parse_family(row.cells[*columns.family]);
    if (!id) {
      id.error().place = {.source = table.source, .line = row.line, .key = "family"};
      return tl::unexpected(id.error());
    }
    tag.family = *id;
  }
  const std::size_t known = family(tag.family).codes.size();
  if (tag.number < 0 || static_cast<std::size_t>(tag.number) >= known) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} has no tag {}, only 0 to {}", to_string(tag.family), tag.number, known - 1),
                {.source = table.source, .line = row.line, .key = "id"});
  }
  return tag;
}

Result<TrueTag> read_row(const CsvTable& table, const CsvRow& row, const Columns& columns) {
  TrueTag tag;
  const auto id = read_tag(table, row, columns);
  if (!id) return tl::unexpected(id.error());
  tag.tag = *id;
  for (std::size_t i = 0; i < kCorners.size(); ++i) {
    const auto value = csv_number(table, row, columns.corners[i]);
    if (!value) return tl::unexpected(value.error());
    tag.corners_px[i / 2][static_cast<Eigen::Index>(i % 2)] = *value;
  }
  constexpr double kLargestPx = 1e6;
  const auto size = optional_number(table, row, columns.size, 0, kLargestPx);
  if (!size) return tl::unexpected(size.error());
  tag.size_px = size->value_or(mean_side_px(tag.corners_px));
  const auto tilt = optional_number(table, row, columns.tilt, 0, 90);
  if (!tilt) return tl::unexpected(tilt.error());
  tag.tilt_deg = *tilt;
  return tag;
}

bool says_no_tag(const CsvRow& row, std::size_t image) {
  for (std::size_t i = 0; i < row.cells.size(); ++i) {
    if (i != image && !row.cells[i].empty()) return false;
  }
  return true;
}

}  // namespace

Result<DetectionTruth> parse_truth(std::string_view text, std::string source) {
  const auto table = parse_csv(text, std::move(source));
  if (!table) return tl::unexpected(table.error());
  const auto columns = find_columns(*table);
  if (!columns) return tl::unexpected(columns.error());
  DetectionTruth truth;
  for (const CsvRow& row : table->rows) {
    const std::string& image = row.cells[columns->image];
    if (image.empty()) {
      return fail(ErrorCode::InvalidArgument, "no image is named",
                  {.source = table->source, .line = row.line, .key = "image"});
    }
    auto& tags = truth[image];
    if (says_no_tag(row, columns->image)) continue;
    auto tag = read_row(*table, row, *columns);
    if (!tag) return tl::unexpected(tag.error());
    tags.push_back(*tag);
  }
  return truth;
}

std::optional<std::string> find_image(const DetectionTruth& truth, std::string_view path) {
  const std::size_t name_start = path.find_last_of('/') + 1;  // npos + 1 == 0
  const std::size_t dot = path.find_last_of('.');
  const bool has_suffix = dot != std::string_view::npos && dot > name_start;
  for (std::string_view rest = path;;) {
    if (const auto found = truth.find(std::string(rest)); found != truth.end()) return found->first;
    if (has_suffix) {
      const std::string_view stem = rest.substr(0, rest.size() - (path.size() - dot));
      if (const auto found = truth.find(std::string(stem)); found != truth.end()) return found->first;
    }
    const std::size_t slash = rest.find('/');
    if (slash == std::string_view::npos) return std::nullopt;
    rest.remove_prefix(slash + 1);
  }
}

}  // namespace waymark
