#include "waymark/app/world/lay_world.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/replay/route_builder.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMaxTableBytes = std::size_t{1} << 24U;
constexpr double kPointEvery_m = 0.15;  // minimum distance between points on the line that is kept
/// A drawn loop may start at a corner, so it may be closed from the side, but not from straight ahead.
constexpr LapClosing kClosing{.distance_m = 0.6, .angle_rad = 2.2};

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',' || c == ';' || c == '\t')
      cells.emplace_back();
    else if (c != ' ' && c != '\r' && c != '#')
      cells.back() += c;
  }
  return cells;
}

std::optional<double> number(const std::vector<std::string>& cells, std::size_t column) {
  if (column >= cells.size()) return std::nullopt;
  double value{};
  const char* end = cells[column].data() + cells[column].size();
  const auto [stop, error] = std::from_chars(cells[column].data(), end, value);
  if (error != std::errc() || stop != end || !(std::abs(value) < 1e6)) return std::nullopt;
  return value;
}

/// Points from the columns x and y of a table. Without a header line, the first two columns are used.
Result<std::vector<Eigen::Vector2d>> points_of_table(const std::string& path) {
  const auto text = read_text_file(path, kMaxTableBytes);
  if (!text) return tl::unexpected(text.error());
  std::vector<Eigen::Vector2d> points;
  std::size_t x = 0;
  std::size_t y = 1;
  int line_number = 0;
  for (std::size_t begin = 0; begin < text->size();) {
    const std::size_t end = std::min(text->find('\n', begin), text->size());
    const std::vector<std::string> cells = cells_of(text->substr(begin, end - begin));
    begin = end + 1;
    ++line_number;
    for (const std::string& axis : {std::string("x"), std::string("y")}) {
      const auto named = [&](const std::string& cell) { return cell == axis || cell == axis + "_m"; };
      if (points.empty() && std::ranges::count_if(cells, named) > 1)
        return fail(ErrorCode::Unreadable, fmt::format("duplicate column '{}'", axis),
                    {.source = path, .line = line_number}, "Keep only one column with this name.");
    }
    const auto column_x = std::ranges::find_if(cells, [](const auto& c) { return c == "x" || c == "x_m"; });
    const auto column_y = std::ranges::find_if(cells, [](const auto& c) { return c == "y" || c == "y_m"; });
    if (points.empty() && column_x != cells.end() && column_y != cells.end()) {
      x = static_cast<std::size_t>(column_x - cells.begin());
      y = static_cast<std::size_t>(column_y - cells.begin());
      continue;
    }
    if (cells.size() == 1 && cells[0].empty()) continue;
    const auto at_x = number(cells, x);
    const auto at_y = number(cells, y);
    if (!at_x || !at_y)
      return fail(ErrorCode::Unreadable, "invalid point", {.source = path, .line = line_number},
                  "Write x,y in metres, or name the columns x and y in the first line.");
    points.emplace_back(*at_x, *at_y);
  }
  return points;
}

/// Robot positions from a recording: ground truth if available, otherwise odometry.
Result<std::vector<Eigen::Vector2d>> points_of_recording(const std::string& path, const JobControl& control) {
  const auto log = open_log(path, control.log_options());
  if (!log) return tl::unexpected(log.error());
  std::vector<Eigen::Vector2d> truth;
  std::vector<Eigen::Vector2d> odometry;
  const Status status = (*log)->visit_samples({}, [&](const Sample& sample) -> Status {
    if (Status wanted = control.go_on(); !wanted) return wanted;
    if (const auto* pose = std::get_if<TruthPose>(&sample))
      truth.push_back(pose->map_T_base.translation().head<2>());
    if (const auto* pose = std::get_if<Odometry>(&sample))
      odometry.push_back(pose->odom_T_base.translation());
    return {};
  });
  if (!status) return tl::unexpected(status.error());
  return truth.empty() ? odometry : truth;
}

/// Keeps only points that are at least kPointEvery_m apart.
std::vector<Eigen::Vector2d> thin_out(const std::vector<Eigen::Vector2d>& points) {
  std::vector<Eigen::Vector2d> kept;
  for (const Eigen::Vector2d& point : points)
    if (kept.empty() || (point - kept.back()).norm() >= kPointEvery_m) kept.push_back(point);
  return kept;
}

struct DrivableLine {
  World world{};
  double repeated_m = 0;  ///< length that was cut off because it repeats the loop
};

/// A line, open or closed, that a driver can follow. Any part that repeats a loop is cut off, as for routes.
DrivableLine line_of(const std::string& name, const std::vector<Eigen::Vector2d>& points) {
  constexpr double kStep_m = 0.05;
  DrivableLine line{.world = {.name = name, .path_closed = false}};
  std::vector<Eigen::Vector2d>& path_m = line.world.path_m;
  path_m = thin_out(points);
  const EvenLine even = even_steps(path_m, kStep_m);
  const auto loop = points_of_first_loop(even.points, kStep_m, kClosing);
  if (!loop) return line;
  line.world.path_closed = true;
  line.repeated_m = kStep_m * static_cast<double>(even.points.size() - *loop);
  path_m.resize(even.sources[*loop]);  // the loop closes on the segment that ends here
  if (path_m.size() > 3 && (path_m.back() - path_m.front()).norm() < kPointEvery_m / 2) path_m.pop_back();
  return line;
}

}  // namespace

Result<World> read_line(const std::string& path, const JobControl& control) {
  const std::string name = std::filesystem::path(path).stem().string();
  const FileKind kind = kind_of(path);
  const bool text_file = path.ends_with(".csv") || path.ends_with(".txt");
  const bool table = is_table_kind(kind) || (text_file && !is_recording(kind));
  const auto points =
      or_wrong_kind(table ? points_of_table(path) : points_of_recording(path, control), path, FileUse::Line);
  if (!points) return tl::unexpected(points.error());
  constexpr double kLargest_m = 500;
  const bool too_large = std::ranges::any_of(*points, [&](const Eigen::Vector2d& point) {
    return !((point - points->front()).cwiseAbs().maxCoeff() < kLargest_m);
  });
  if (too_large)
    return fail(ErrorCode::LimitExceeded, "the line extends more than 500 m from its start", {.source = path},
                "Coordinates must be in metres. Are these in millimetres?");
  DrivableLine line = line_of(name, *points);
  if (line.world.path_m.size() < 3)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the line has only {} at least {} m apart; three are needed",
                            counted(line.world.path_m.size(), "point"), kPointEvery_m),
                {.source = path}, "Add points, in metres and in the order of the drive.");
  if (line.repeated_m > kUsualOverlap_m)
    control.note(fmt::format("{}: the last {:.2f} m of the line repeat its loop and are omitted", path,
                             line.repeated_m));
  return std::move(line.world);
}

Status check_new_world(const std::string& output) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(output, ignored)) return check_output_file(output);
  return fail(ErrorCode::InvalidArgument, "the file already exists", {.source = output},
              "Choose another name, or remove the file.");
}

Result<LayWorldJob> described_lay_world(const LayWorldRequest& request, const TagLayoutOptions& layout) {
  auto robot = read_named_robot(request.robot_file);
  if (!robot) return tl::unexpected(robot.error());
  if (Status fresh = check_new_world(request.output); !fresh) return tl::unexpected(fresh.error());
  return LayWorldJob{
      .path = request.path, .output = request.output, .robot = std::move(*robot), .layout = layout};
}

Result<LayWorldReport> lay_world(const LayWorldJob& job, const JobControl& control) {
  if (Status status = check_output_file(job.output); !status) return tl::unexpected(status.error());
  Result<World> line = read_line(job.path, control);
  if (!line) return tl::unexpected(line.error());
  const RobotModel& model = job.robot.model;
  Result<World> world = lay_tags(std::move(*line), model, job.robot.camera, job.layout);
  if (!world) return tl::unexpected(world.error());
  const TagCameraOptions tag_camera{.max_range_m = job.layout.max_range_m};
  const auto check = check_world(*world, model, job.robot.camera, tag_camera);
  if (!check) return tl::unexpected(check.error());
  if (Status status = control.go_on(); !status) return tl::unexpected(status.error());
  const std::string yaml = to_yaml(*world);
  const auto earlier = move_aside(job.output, yaml);
  if (!earlier) return tl::unexpected(earlier.error());
  if (!earlier->empty()) control.note("the existing file was renamed to " + *earlier);
  if (Status status = write_text_file(job.output, yaml); !status) return tl::unexpected(status.error());
  return LayWorldReport{.file = job.output, .world = std::move(*world), .check = *check};
}

ReportFields fields(const LayWorldReport& report) {
  const WorldCheck& check = report.check;
  return {{"file", "World file", report.file},
          {"tags", "Number of tags", report.world.tags.tags.size()},
          {"closed", "Whether the line is a lap", report.world.path_closed},
          {"lap_m", "Length of the line", check.lap_m},
          {"two_tags_fraction", "Fraction of the line along which two or more tags are in view",
           check.two_tags_fraction},
          {"one_tag_fraction", "Fraction of the line along which one or more tags are in view",
           check.one_tag_fraction},
          {"min_clearance_m", "Smallest distance in space from the hull to a tag", check.min_clearance_m}};
}

std::string to_text(const LayWorldReport& report) {
  const WorldCheck& check = report.check;
  return fmt::format(
      "{}: {} tags along {} of {:.2f} m\n"
      "two or more tags in view   {:.1f} % of the line, one or more {:.1f} %\n"
      "hull to the nearest tag    {:.3f} m ({})\n",
      report.file, report.world.tags.tags.size(), report.world.path_closed ? "a lap" : "an open line",
      check.lap_m, 100 * check.two_tags_fraction, 100 * check.one_tag_fraction, check.min_clearance_m,
      check.nearest_tag ? to_string(*check.nearest_tag) : "no tag");
}

}  // namespace waymark
