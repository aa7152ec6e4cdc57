#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/detections_json.hpp"
#include "waymark/cli/log_options.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/stage_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/world_file.hpp"
#include "waymark/jobs/staged_folder.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/simulation/tag_layout.hpp"
#include "waymark/simulation/world_check.hpp"

namespace waymark::cli {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 24U;
constexpr double kPointEvery = 0.15;   // m, of the line that is kept
constexpr double kClosedWithin = 0.6;  // m, from its end to its beginning
constexpr double kShortestLoop = 2;    // m

struct NewArgs {
  explicit NewArgs(CLI::App& app) : layout(app, "Tags") {}

  std::string path;
  std::string robot_file = "limo";
  std::string output;
  bool json = false;
  OptionFlags<TagLayoutOptions> layout;
};

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

/// The columns x and y of a table with a heading, or the first two of one without.
Result<std::vector<Eigen::Vector2d>> points_of_table(const std::string& path) {
  const auto text = read_text_file(path, kMostBytes);
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
      return fail(ErrorCode::Unreadable, "this line holds no point", {.source = path, .line = line_number},
                  "Write x,y in metres, or name the columns x and y in the first line.");
    points.emplace_back(*at_x, *at_y);
  }
  return points;
}

/// Where the robot of a recording went: by truth where it is known, else by odometry.
Result<std::vector<Eigen::Vector2d>> points_of_recording(const std::string& path) {
  const auto log = open_log(path, until_interrupted());
  if (!log) return tl::unexpected(log.error());
  std::vector<Eigen::Vector2d> truth;
  std::vector<Eigen::Vector2d> odometry;
  const Status status = (*log)->visit_samples({}, [&](const Sample& sample) -> Status {
    if (const auto* pose = std::get_if<TruthPose>(&sample))
      truth.push_back(pose->map_T_base.translation().head<2>());
    if (const auto* pose = std::get_if<Odometry>(&sample))
      odometry.push_back(pose->odom_T_base.translation());
    return {};
  });
  if (!status) return tl::unexpected(status.error());
  return truth.empty() ? odometry : truth;
}

/// A line a driver can follow: points some way apart, and whether it is a loop (its overlap cut off).
World line_of(const std::string& name, const std::vector<Eigen::Vector2d>& points) {
  World world{.name = name, .path_closed = false};
  double driven = 0;
  for (const Eigen::Vector2d& point : points) {
    if (!world.path_m.empty()) {
      const double step = (point - world.path_m.back()).norm();
      if (step < kPointEvery) continue;
      driven += step;
    }
    const bool again = driven > kShortestLoop && (point - world.path_m.front()).norm() < kClosedWithin;
    if (again) {
      world.path_closed = true;
      break;
    }
    world.path_m.push_back(point);
  }
  return world;
}

Result<World> drawn_line(const std::string& path) {
  const std::string name = std::filesystem::path(path).stem().string();
  const bool table = path.ends_with(".csv") || path.ends_with(".txt");
  const auto points = table ? points_of_table(path) : points_of_recording(path);
  if (!points) return tl::unexpected(points.error());
  constexpr double kLargest_m = 500;
  const bool too_large = std::ranges::any_of(*points, [&](const Eigen::Vector2d& point) {
    return !((point - points->front()).cwiseAbs().maxCoeff() < kLargest_m);
  });
  if (too_large)
    return fail(ErrorCode::LimitExceeded, "the line goes farther than 500 m from its start", {.source = path},
                "Coordinates are in metres: are these millimetres?");
  World world = line_of(name, *points);
  if (world.path_m.size() < 3)
    return fail(ErrorCode::InvalidArgument, "no line of three points or more that are 0.15 m apart",
                {.source = path});
  return world;
}

ExitCode make_world(const NewArgs& args, Console& console) {
  TagLayoutOptions options;
  Status status = args.layout.apply(options);
  const auto robot_path = find_shared("robots", args.robot_file);
  const auto robot = robot_path ? read_robot(*robot_path) : tl::unexpected(robot_path.error());
  if (status && !robot) status = tl::unexpected(robot.error());
  if (status && std::filesystem::exists(args.output))
    status = fail(ErrorCode::InvalidArgument, "the file exists", {.source = args.output},
                  "Choose another name, or remove it.");
  if (!status) {
    console.say(status.error());
    return ExitCode::Usage;
  }
  const Status writable = check_output_file(args.output);
  Result<World> world = writable ? drawn_line(args.path) : tl::unexpected(writable.error());
  if (world) world = lay_tags(std::move(*world), robot->model, robot->camera, options);
  const TagCameraOptions eye{.max_range_m = options.max_range_m};
  const auto check =
      world ? check_world(*world, robot->model, robot->camera, eye) : tl::unexpected(world.error());
  if (check) status = write_text_file(args.output, to_yaml(*world));
  if (!check || !status) {
    console.say(check ? status.error() : check.error());
    return ExitCode::SomeFailed;
  }
  if (args.json) {
    console.print(json_line({{"file", args.output},
                             {"tags", world->tags.tags.size()},
                             {"closed", world->path_closed},
                             {"lap_m", check->lap_m},
                             {"two_tags_fraction", check->two_tags_fraction},
                             {"one_tag_fraction", check->one_tag_fraction},
                             {"min_clearance_m", check->min_clearance_m}}));
  } else {
    console.print(
        fmt::format("{}: {} tags along {} of {:.2f} m\n"
                    "two tags or more in view   {:.1f} % of the way, one or more {:.1f} %\n"
                    "hull to the nearest tag    {:.3f} m ({})\n",
                    args.output, world->tags.tags.size(), world->path_closed ? "a lap" : "a way",
                    check->lap_m, 100 * check->two_tags_fraction, 100 * check->one_tag_fraction,
                    check->min_clearance_m, check->nearest_tag ? to_string(*check->nearest_tag) : "no tag"));
  }
  return ExitCode::Ok;
}

Run prepare_world_new(CLI::App& app) {
  const auto args = std::make_shared<NewArgs>(app);
  app.add_option("--path", args->path,
                 "The line: a .csv file with columns x and y in metres, or a recording of a drive")
      ->required()
      ->type_name("FILE");
  app.add_option("-o,--output", args->output, "World to write (.yaml)")->required()->type_name("FILE");
  app.add_option("--robot-file", args->robot_file, "Body and camera of the robot: a name, or a .yaml file")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return make_world(*args, console); };
}

}  // namespace

Verb world_new_verb() {
  return {
      .name = "new",
      .sentence = "A world with tags laid along a line that was drawn or driven",
      .help =
          R"(Puts upright tags beside the line, as few as it takes for the camera to see two of them from everywhere, none
nearer to the hull than --clearance-m (measured in space), and says how well that went. A line that comes back
to its beginning is a lap.

Exit code: 0 a world was written, 1 the line could not be read or no tag placed, 2 wrong usage.

Example:
  waymark world new --path lap.mcap -o mine.yaml --tag-size-m 0.12
)",
      .prepare = prepare_world_new,
      .verbs = {}};
}

}  // namespace waymark::cli
