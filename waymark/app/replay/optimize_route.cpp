#include "waymark/app/replay/optimize_route.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "waymark/app/common/output_files.hpp"
#include "waymark/app/common/route_files.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/plot/run_figures.hpp"
#include "waymark/replay/route_checks.hpp"
#include "waymark/replay/safety_limiter.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

plot::PathLayer layer(const std::string& name, const Route& route, const TagMap& tags, plot::Color color) {
  plot::PathLayer result{name, {}, tags, color};
  for (std::size_t i = 0; i < route.points.size() + (route.closed ? 1 : 0); ++i)
    result.path.push_back({SensorTime{}, lift(route.points[i % route.points.size()].map_T_base)});
  return result;
}

/// Writes the route and its figure; existing files of a route with this name are renamed.
Status write_route_files(const OptimizeJob& job, const Route& taught, const TagMap& tags,
                         OptimizeReport& result) {
  Result<StagedFolder> staged = StagedFolder::open(job.folder);
  if (!staged) return tl::unexpected(staged.error());
  const std::string name = route_file_name(job.name);
  Status status = write_route(staged->path() / name, with_map(result.found.route, tags));
  result.files.push_back(name);
  if (status)
    status =
        write_figure(staged->path() / file_name_for_route("route", job.name, ".svg"),
                     plot::path_figure("Taught and optimised",
                                       {layer("taught", taught, tags, plot::kTaughtColor),
                                        layer("optimised", result.found.route, {}, plot::kEstimateColor)}),
                     {".svg"}, result.files);
  if (!status) return staged->failed(status.error());
  auto aside = staged->put_in_place(files_of_route(job.name));
  if (!aside) return tl::unexpected(aside.error());
  result.backups = std::move(*aside);
  for (std::string& file : result.files) file = (fs::path(job.folder) / fs::path(file).filename()).string();
  return {};
}

}  // namespace

std::string drive_command(const OptimizeJob& job) {
  const ProfileOptions& profile = job.profile;
  std::string command = fmt::format("waymark replay {} route={}", shell_word(job.folder), job.name);
  const SafetyOptions usual;
  if (profile.speed_m_s > usual.max_speed_m_s) command += fmt::format(" max_speed_m_s={}", profile.speed_m_s);
  std::vector<double> defaults;
  const ProfileOptions plain;
  ProfileOptions::fields(plain, [&](double value, const auto&) { defaults.push_back(value); });
  std::size_t i = 0;
  ProfileOptions::fields(profile, [&](double value, const auto& field) {
    if (value != defaults[i++] && field.name != "speed_m_s")
      command += fmt::format(" {}={}", field.name, value);
  });
  return command;
}

Result<OptimizerOptions> read_weights(const std::string& path) {
  constexpr std::size_t kMaxOptionsBytes = std::size_t{1} << 16U;
  const auto text = read_text_file(path, kMaxOptionsBytes);
  if (!text) return tl::unexpected(text.error());
  return parse_fields<OptimizerOptions>(*text, path);
}

Result<OptimizeReport> optimize_route_of(const OptimizeJob& job) {
  const fs::path folder = job.folder;
  if (Status valid = check_map_folder(folder); !valid) return tl::unexpected(valid.error());
  const auto map = read_map(folder / "map.yaml");
  if (!map) return tl::unexpected(map.error());
  const auto taught = read_route(folder / "route.yaml");
  if (!taught) return tl::unexpected(taught.error());
  if (Status ahead = check_sideways(*taught, (folder / "route.yaml").string()); !ahead)
    return tl::unexpected(ahead.error());
  if (Status status = check_output_folder(folder); !status) return tl::unexpected(status.error());
  std::error_code ignored;
  const auto robot_path = fs::exists(folder / "robot.yaml", ignored) ? Result<fs::path>(folder / "robot.yaml")
                                                                     : find_shared("robots", "limo");
  if (!robot_path) return tl::unexpected(robot_path.error());
  const auto robot = read_robot(*robot_path);
  if (!robot) return tl::unexpected(robot.error());
  auto found = optimize_route(*taught, {&map->tags, &robot->model, &robot->camera}, job.profile, job.options);
  if (!found) return tl::unexpected(found.error());
  OptimizeReport result{.name = job.name, .found = std::move(*found)};
  if (job.profile.speed_m_s > 0) {  // the route specifies the speed, which may exceed the default of the
                                    // limiter
    for (RoutePoint& point : result.found.route.points)
      point.speed_m_s = std::copysign(job.profile.speed_m_s, point.speed_m_s);
  }
  const Status status = write_route_files(job, *taught, map->tags, result);
  if (!status) return tl::unexpected(status.error());
  return result;
}

std::string to_text(const OptimizeJob& job, const OptimizeReport& report) {
  return to_text(report.found) +
         fmt::format("{}: replay it with `{}`\n", report.files.front(), drive_command(job));
}

ReportFields fields(const RouteFigures& figures) {
  return {
      {"lap_s", "Duration of a lap with the speed profile", figures.lap_s},
      {"length_m", "Length of the route", figures.length_m},
      {"max_curvature_1_m", "Largest curvature", figures.max_curvature_1_m},
      {"smoothness_1_m4", "Mean square of the change of curvature along the route", figures.smoothness_1_m4},
      {"min_clearance_m", "3D distance from the hull to the nearest tag", figures.min_clearance_m},
      {"two_tags_fraction", "Share of the route with two or more tags in view", figures.two_tags_fraction},
      {"mean_tags", "Mean number of tags in view along the route", figures.mean_tags},
      {"largest_offset_m", "Largest distance from the taught route", figures.largest_offset_m}};
}

ReportFields fields(const OptimizeReport& report) {
  return {{"route", "Name of the new route", report.name},
          {"taught", "The taught route", report.found.taught},
          {"optimized", "The new route", report.found.optimized},
          {"files", "Written files", report.files}};
}

std::string to_text(const OptimizedRoute& found) {
  std::string text = fmt::format("{:<38}{:>10}{:>12}\n", "", "taught", "optimised");
  const auto add = [&](const char* what, double taught, double optimised, int digits) {
    text += fmt::format("{:<38}{:>10.{}f}{:>12.{}f}\n", what, taught, digits, optimised, digits);
  };
  const RouteFigures& a = found.taught;
  const RouteFigures& b = found.optimized;
  add("lap [s]", a.lap_s, b.lap_s, 2);
  add("length [m]", a.length_m, b.length_m, 2);
  add("largest curvature [1/m]", a.max_curvature_1_m, b.max_curvature_1_m, 2);
  add("change of curvature, mean square [m^-4]", a.smoothness_1_m4, b.smoothness_1_m4, 2);
  add("hull to the nearest tag [m]", a.min_clearance_m, b.min_clearance_m, 3);
  add("two or more tags in view [%]", 100 * a.two_tags_fraction, 100 * b.two_tags_fraction, 1);
  add("tags in view, mean", a.mean_tags, b.mean_tags, 2);
  add("largest offset from the taught route [m]", 0, b.largest_offset_m, 3);
  return text;
}

}  // namespace waymark
