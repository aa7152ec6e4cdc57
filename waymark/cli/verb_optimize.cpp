#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/detections_json.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/jobs/figure_files.hpp"
#include "waymark/jobs/route_files.hpp"
#include "waymark/jobs/staged_folder.hpp"
#include "waymark/plot/loop_figures.hpp"
#include "waymark/replay/route_optimizer.hpp"
#include "waymark/replay/safety_limiter.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostWeightBytes = std::size_t{1} << 16U;

struct OptimizeArgs {
  explicit OptimizeArgs(CLI::App& app) : weights(app, "Weights"), profile(app, "Speed") {}

  std::string folder;
  std::string name = "best";
  std::string weights_file;
  bool json = false;
  OptionFlags<OptimizerOptions> weights;
  OptionFlags<ProfileOptions> profile;
};

Result<OptimizerOptions> weights_of(const OptimizeArgs& args) {
  OptimizerOptions options;
  if (!args.weights_file.empty()) {
    const auto text = read_text_file(args.weights_file, kMostWeightBytes);
    if (!text) return tl::unexpected(text.error());
    const auto read = parse_fields<OptimizerOptions>(*text, args.weights_file);
    if (!read) return tl::unexpected(read.error());
    options = *read;
  }
  if (Status status = args.weights.apply(options); !status) return tl::unexpected(status.error());
  return options;
}

plot::PathLayer layer(const std::string& name, const Route& route, const TagMap& tags, plot::Color color) {
  plot::PathLayer result{name, {}, tags, color};
  for (std::size_t i = 0; i < route.points.size() + (route.closed ? 1 : 0); ++i)
    result.path.push_back({SensorTime{}, lift(route.points[i % route.points.size()].map_T_base)});
  return result;
}

nlohmann::ordered_json json_of(const RouteFigures& f) {
  return {{"lap_s", f.lap_s},
          {"length_m", f.length_m},
          {"max_curvature_1_m", f.max_curvature_1_m},
          {"smoothness_1_m4", f.smoothness_1_m4},
          {"min_clearance_m", f.min_clearance_m},
          {"two_tags_fraction", f.two_tags_fraction},
          {"mean_tags", f.mean_tags},
          {"largest_offset_m", f.largest_offset_m}};
}

std::string comparison(const OptimizedRoute& found) {
  std::string text = fmt::format("{:<38}{:>10}{:>12}\n", "", "taught", "optimised");
  const auto add = [&](const char* what, double taught, double better, int digits) {
    text += fmt::format("{:<38}{:>10.{}f}{:>12.{}f}\n", what, taught, digits, better, digits);
  };
  const RouteFigures& a = found.taught;
  const RouteFigures& b = found.optimized;
  add("lap [s]", a.lap_s, b.lap_s, 2);
  add("length [m]", a.length_m, b.length_m, 2);
  add("tightest curve [1/m]", a.max_curvature_1_m, b.max_curvature_1_m, 2);
  add("change of curvature, mean square [m^-4]", a.smoothness_1_m4, b.smoothness_1_m4, 2);
  add("hull to the nearest tag [m]", a.min_clearance_m, b.min_clearance_m, 3);
  add("two tags or more in view [%]", 100 * a.two_tags_fraction, 100 * b.two_tags_fraction, 1);
  add("tags in view, mean", a.mean_tags, b.mean_tags, 2);
  add("farthest from the taught route [m]", 0, b.largest_offset_m, 3);
  return text;
}

struct Optimized {
  OptimizedRoute found{};
  std::vector<std::string> files{};
  std::vector<std::string> set_aside{};
};

/// The route with its picture, in the place of what the folder holds of a route of this name.
Status write_route_files(const OptimizeArgs& args, const Route& taught, const TagMap& tags,
                         Optimized& result) {
  Result<StagedFolder> staged = StagedFolder::open(args.folder);
  if (!staged) return tl::unexpected(staged.error());
  const std::string name = route_file_name(args.name);
  Status status = write_route(staged->path() / name, with_map(result.found.route, tags));
  result.files.push_back(name);
  if (status)
    status =
        write_figure(staged->path() / file_name_for_route("route", args.name, ".svg"),
                     plot::path_figure("Taught and optimised",
                                       {layer("taught", taught, tags, plot::kTaughtColor),
                                        layer("optimised", result.found.route, {}, plot::kEstimateColor)}),
                     {".svg"}, result.files);
  if (!status) return staged->failed(status.error());
  auto aside = staged->put_in_place(files_of_route(args.name));
  if (!aside) return tl::unexpected(aside.error());
  result.set_aside = std::move(*aside);
  for (std::string& file : result.files) file = (fs::path(args.folder) / fs::path(file).filename()).string();
  return {};
}

/// What drives the route as it was promised: the speed is the route's, the rest is told.
std::string drive_command(const OptimizeArgs& args, const ProfileOptions& profile) {
  std::string command = fmt::format("waymark replay {} --route {}", args.folder, args.name);
  const SafetyOptions usual;
  if (profile.speed_m_s > usual.max_speed_m_s)
    command += fmt::format(" --max-speed-m-s {}", profile.speed_m_s);
  std::vector<double> defaults;
  const ProfileOptions plain;
  ProfileOptions::fields(plain, [&](double value, const auto&) { defaults.push_back(value); });
  std::size_t i = 0;
  ProfileOptions::fields(profile, [&](double value, const auto& field) {
    std::string flag(field.name);
    std::ranges::replace(flag, '_', '-');
    if (value != defaults[i++] && flag != "speed-m-s") command += fmt::format(" --{} {}", flag, value);
  });
  return command;
}

Result<Optimized> optimize_folder(const OptimizeArgs& args, const OptimizerOptions& options,
                                  const ProfileOptions& profile) {
  const fs::path folder = args.folder;
  const auto map = read_map(folder / "map.yaml");
  if (!map) return tl::unexpected(map.error());
  const auto taught = read_route(folder / "route.yaml");
  if (!taught) return tl::unexpected(taught.error());
  if (Status status = check_output_folder(folder); !status) return tl::unexpected(status.error());
  std::error_code ignored;
  const auto robot_path = fs::exists(folder / "robot.yaml", ignored) ? Result<fs::path>(folder / "robot.yaml")
                                                                     : find_shared("robots", "limo");
  if (!robot_path) return tl::unexpected(robot_path.error());
  const auto robot = read_robot(*robot_path);
  if (!robot) return tl::unexpected(robot.error());
  auto found = optimize_route(*taught, {&map->tags, &robot->model, &robot->camera}, profile, options);
  if (!found) return tl::unexpected(found.error());
  Optimized result{.found = std::move(*found)};
  if (profile.speed_m_s > 0) {  // the route says it, so that every drive of it asks for it
    for (RoutePoint& point : result.found.route.points)
      point.speed_m_s = std::copysign(profile.speed_m_s, point.speed_m_s);
  }
  const Status status = write_route_files(args, *taught, map->tags, result);
  if (!status) return tl::unexpected(status.error());
  return result;
}

ExitCode optimize(const OptimizeArgs& args, Console& console) {
  ProfileOptions profile;
  Status status = check_route_name(args.name, "--name");
  if (status) status = args.profile.apply(profile);
  const auto options = status ? weights_of(args) : tl::unexpected(status.error());
  if (!options) {
    console.say(options.error());
    return ExitCode::Usage;
  }
  const auto result = optimize_folder(args, *options, profile);
  if (!result) {
    console.say(result.error());
    return ExitCode::SomeFailed;
  }
  if (!result->set_aside.empty())
    console.say(fmt::format("what stood there before has a number in its name now: {}",
                            fmt::join(result->set_aside, ", ")));
  if (args.json)
    console.print(json_line({{"route", args.name},
                             {"taught", json_of(result->found.taught)},
                             {"optimized", json_of(result->found.optimized)},
                             {"files", result->files}}));
  else
    console.print(comparison(result->found) + fmt::format("{}: drive it with `{}`\n", result->files.front(),
                                                          drive_command(args, profile)));
  return ExitCode::Ok;
}

Run prepare_optimize(CLI::App& app) {
  const auto args = std::make_shared<OptimizeArgs>(app);
  app.add_option("MAP", args->folder, "Folder that `waymark map` wrote")->required()->type_name("");
  app.add_option("--name", args->name, "Name of the new route; the taught one stays as it is")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option("--weights", args->weights_file, "What a route is worth: a .yaml file with the keys below")
      ->type_name("FILE");
  app.add_flag("--json", args->json, "One JSON object instead of a table");
  return [args](Console& console) { return optimize(*args, console); };
}

}  // namespace

Verb optimize_verb() {
  return {
      .name = "optimize",
      .sentence = "Make a faster or smoother route beside a taught one",
      .help =
          R"(Moves the route sideways within a corridor and weighs lap time, smoothness, distance from tags and tags in
view. No place comes nearer to a tag than the taught route does anywhere, and two tags are in view for as much
of the way: where that cannot be had, the taught route is kept. Writes route-NAME.yaml and a picture
(route-NAME.svg) into the folder. The taught route remains what `waymark replay` drives unless asked.

Exit code: 0 a route was written, 1 a file was unusable, 2 wrong usage.

Example:
  waymark optimize map --name fast --speed-m-s 0.8
)",
      .prepare = prepare_optimize,
      .verbs = {}};
}

}  // namespace waymark::cli
