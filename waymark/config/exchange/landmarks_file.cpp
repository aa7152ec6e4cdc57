#include "waymark/config/exchange/landmarks_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <vector>

#include <fmt/format.h>

#include "waymark/config/exchange/field_layouts.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml_tree.hpp"
#include "waymark/evaluation/csv.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMaxLandmarkBytes = std::size_t{1} << 26U;

/// Indices of the columns.
struct Columns {
  std::size_t id = 0;
  std::size_t x = 0;
  std::size_t y = 0;
};

/// The column with the first of these names that exists.
std::optional<std::size_t> column_of(const CsvTable& table, std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names)
    if (const auto column = table.column(name)) return column;
  return std::nullopt;
}

Result<Columns> columns_of(const CsvTable& table) {
  const auto id = column_of(table, {"id", "landmark", "tag"});
  const auto x = column_of(table, {"x_m", "x"});
  const auto y = column_of(table, {"y_m", "y"});
  if (id && x && y) return Columns{*id, *x, *y};
  return fail(ErrorCode::Unreadable, "not the columns of a map of points",
              {.source = table.source, .line = 1}, "The first line must contain id, x and y.");
}

Result<LandmarkPoint> point_of(const CsvTable& table, const CsvRow& row, const Columns& columns) {
  const Result<int> id = csv_integer(table, row, columns.id);
  if (!id) return tl::unexpected(id.error());
  const Result<double> x = csv_number(table, row, columns.x);
  if (!x) return tl::unexpected(x.error());
  const Result<double> y = csv_number(table, row, columns.y);
  if (!y) return tl::unexpected(y.error());
  return LandmarkPoint{*id, {*x, *y}};
}

Result<LandmarksFile> parse_points(std::string_view text, const std::string& source) {
  const Result<CsvTable> table = parse_csv(text, source);
  if (!table) return tl::unexpected(table.error());
  const Result<Columns> columns = columns_of(*table);
  if (!columns) return tl::unexpected(columns.error());
  std::vector<LandmarkPoint> points;
  for (const CsvRow& row : table->rows) {
    const Result<LandmarkPoint> point = point_of(*table, row, *columns);
    if (!point) return tl::unexpected(point.error());
    points.push_back(*point);
  }
  Result<Landmarks> landmarks = Landmarks::of_points(points);
  if (!landmarks) {
    Error error = landmarks.error();
    error.place.source = source;
    return tl::unexpected(error);
  }
  return LandmarksFile{std::move(*landmarks), {}, "points"};
}

/// "tag_3" gives 3.
std::optional<int> number_in(std::string_view key) {
  std::size_t begin = key.size();
  while (begin > 0 && key[begin - 1] >= '0' && key[begin - 1] <= '9') --begin;
  int number = 0;
  const auto [end, error] = std::from_chars(key.data() + begin, key.data() + key.size(), number);
  return error == std::errc() ? std::optional(number) : std::nullopt;
}

/// Reads [x, y, z, yaw] of a board's centre; yaw is the heading of a robot that faces the board.
Result<SE3> academy_pose(const YamlCursor& cursor) {
  const Result<std::vector<double>> n = cursor.exactly_numbers(4);
  if (!n) return tl::unexpected(n.error());
  const double c = std::cos((*n)[3]);
  const double s = std::sin((*n)[3]);
  const Eigen::Matrix3d R = (Eigen::Matrix3d() << s, 0, c, -c, 0, s, 0, -1, 0).finished();
  constexpr double kHalfBoard = 0.01;
  return SE3(SO3::from_matrix(R), Eigen::Vector3d((*n)[0], (*n)[1], (*n)[2]) - kHalfBoard * R.col(2));
}

/// Side of the black square of tags in the Robotics Academy's worlds; its files do not contain it.
constexpr double kAcademyTagSize_m = 0.24;

Status read_academy(const YamlCursor& cursor, std::optional<double> tag_size_m, TagMap& map) {
  const std::vector<YamlCursor> values = cursor.children();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string& key = cursor.node().keys[i];
    const std::optional<int> number = number_in(key);
    if (!number) {
      if (values[i].is_map())
        if (Status status = read_academy(values[i], tag_size_m, map); !status) return status;
      continue;
    }
    YamlCursor pose = values[i];
    if (pose.is_map()) {
      const std::vector<YamlCursor> inner = pose.children();
      const auto list = std::ranges::find_if(inner, [](const YamlCursor& c) { return c.is_sequence(); });
      if (list != inner.end()) pose = *list;
    }
    const Result<SE3> map_T_tag = academy_pose(pose);
    if (!map_T_tag) return tl::unexpected(map_T_tag.error());
    const TagId tag{.number = *number};
    if (!map.tags
             .emplace(tag,
                      MappedTag{.map_T_tag = *map_T_tag, .size_m = tag_size_m.value_or(kAcademyTagSize_m)})
             .second)
      return pose.fail_here(ErrorCode::InvalidArgument, fmt::format("tag {} is given twice", *number));
  }
  return {};
}

/// The first line that is not a comment.
std::string_view first_line(std::string_view text) {
  while (text.starts_with('#')) text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  return text.substr(0, text.find('\n'));
}

}  // namespace

Result<LandmarksFile> parse_landmarks(std::string_view text, const std::string& source,
                                      std::optional<double> tag_size_m) {
  if (tag_size_m && !is_tag_size(*tag_size_m))
    return fail(ErrorCode::InvalidArgument,
                fmt::format("a tag size of {:g} m is not greater than 0", *tag_size_m), {.key = "tag_size_m"},
                "Give the side of the black square in metres.");
  if (looks_like_wpilib_layout(text)) {
    const Result<TagMap> layout = parse_wpilib_layout(text, source, tag_size_m);
    if (!layout) return tl::unexpected(layout.error());
    LandmarksFile file{Landmarks(*layout), *layout, "wpilib", field_size_of(text)};
    if (!tag_size_m) file.notes.push_back(note_of_assumed_size(source, kWpilibTagSize_m));
    return file;
  }
  if (looks_like_fmap(text)) {
    const Result<TagMap> field = parse_fmap(text, source);
    if (!field) return tl::unexpected(field.error());
    return LandmarksFile{Landmarks(*field), *field, "fmap", field_size_of(text)};
  }
  const std::string_view first = first_line(text);
  if (first.find(',') != std::string_view::npos && first.find(':') == std::string_view::npos)
    return parse_points(text, source);
  if (text.find("waymark-map") != std::string_view::npos) {
    Result<MapFile> map = parse_map(text, source);
    if (!map) return tl::unexpected(map.error());
    return LandmarksFile{Landmarks(map->tags), map->tags, "waymark"};
  }
  const Result<YamlNode> tree = parse_yaml(text, source);
  if (!tree) return tl::unexpected(tree.error());
  const YamlCursor root(*tree, source);
  LandmarksFile file{.landmarks = {}, .tags = {}, .format = "academy"};
  if (root.is_map())
    if (Status status = read_academy(root, tag_size_m, file.tags); !status)
      return tl::unexpected(status.error());
  if (file.tags.tags.empty())
    return fail(ErrorCode::Unreadable, "not a map in a supported format", {.source = source},
                "Supported: map.yaml of `waymark map`, apriltags_poses.yaml of the Robotics Academy, field "
                "layouts of WPILib "
                "(JSON, CSV), field maps of Limelight (FMAP), CSV with id, x, y.");
  file.landmarks = Landmarks(file.tags);
  if (!tag_size_m) file.notes.push_back(note_of_assumed_size(source, kAcademyTagSize_m));
  return file;
}

Result<LandmarksFile> read_landmarks(const std::filesystem::path& path, std::optional<double> tag_size_m) {
  std::error_code ignored;
  const std::filesystem::path file = map_file_of(path);
  const std::filesystem::path inner = path / "map" / "map.yaml";
  if (file != path && !std::filesystem::exists(file, ignored) && std::filesystem::exists(inner, ignored))
    return fail(ErrorCode::NotFound, "the folder contains no map.yaml", {.source = path.string()},
                fmt::format("Did you mean {}?", inner.parent_path().string()));
  const Result<std::string> text = read_text_file(file, kMaxLandmarkBytes);
  if (!text) return tl::unexpected(text.error());
  return parse_landmarks(*text, file.string(), tag_size_m);
}

}  // namespace waymark
