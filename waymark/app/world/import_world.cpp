#include "waymark/app/world/import_world.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/common/staged_folder.hpp"
#include "waymark/app/world/lay_world.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/world_file.hpp"
#include "waymark/sdf/read_sdf.hpp"

namespace waymark {
namespace {

/// A metre ahead of a model, or of the origin.
Status short_line(const SdfScene& scene, const std::string& start, ImportWorldReport& report) {
  const auto model = std::ranges::find_if(
      scene.models, [&](const SdfModelPose& m) { return start.empty() ? !m.fixed : m.name == start; });
  const bool there = model != scene.models.end();
  if (!start.empty() && !there) {
    std::string names;
    for (const SdfModelPose& known : scene.models) names += (names.empty() ? "" : ", ") + known.name;
    return fail(ErrorCode::NotFound, fmt::format("there is no model '{}'", start), {.key = "--start"},
                fmt::format("There are {}.", names));
  }
  const SE3 from = there ? model->world_T_model : SE3();
  const Eigen::Vector2d begin = from.translation().head<2>();
  const Eigen::Vector2d ahead = (from.rotation() * Eigen::Vector3d::UnitX()).head<2>();
  report.world.path_closed = false;
  for (const double way_m : {0.0, 0.5, 1.0})
    report.world.path_m.emplace_back(begin + way_m * ahead.normalized());
  report.warnings.push_back(fmt::format(
      "the line to drive is a metre ahead of {}: --path has another, and --driver keyboard needs none",
      there ? model->name : "the origin"));
  return {};
}

}  // namespace

Result<ImportWorldReport> import_world(const ImportWorldJob& job, const JobControl& control) {
  if (Status status = check_output_file(job.output); !status) return tl::unexpected(status.error());
  const auto scene = read_sdf(job.file, job.folders);
  if (!scene) return tl::unexpected(scene.error());
  ImportWorldReport report{.warnings = scene->warnings};
  auto world = world_of(*scene, job.families, report.warnings);
  if (!world) {
    for (const std::string& warning : report.warnings) control.note("warning: " + warning);  // why, perhaps
    Error error = world.error();
    if (error.place.source.empty()) error.place.source = job.file.string();
    return tl::unexpected(std::move(error));
  }
  report.world = std::move(*world);
  for (const SdfLight& light : scene->lights)
    report.lights.push_back(fmt::format("{}: {}, intensity {:g}", light.name, light.kind, light.intensity));
  if (job.path.empty()) {
    if (Status status = short_line(*scene, job.start, report); !status) return tl::unexpected(status.error());
  } else {
    auto line = read_line(job.path, control);
    if (!line) return tl::unexpected(line.error());
    report.world.path_m = std::move(line->path_m);
    report.world.path_closed = line->path_closed;
  }
  const std::string yaml = to_yaml(report.world);
  if (const auto again = parse_world(yaml, job.output.string()); !again) return tl::unexpected(again.error());
  const auto earlier = move_aside(job.output, yaml);
  if (!earlier) return tl::unexpected(earlier.error());
  if (!earlier->empty()) control.note("the earlier file is kept: " + *earlier);
  if (Status status = write_text_file(job.output, yaml); !status) return tl::unexpected(status.error());
  return report;
}

std::string to_text(const ImportWorldReport& report, const std::string& file) {
  const World& world = report.world;
  std::string text = fmt::format("{}: {} tags ({} to {}), {} pieces of furniture\n", file,
                                 world.tags.tags.size(), to_string(world.tags.tags.begin()->first),
                                 to_string(world.tags.tags.rbegin()->first), world.occluders.size());
  if (world.tag_board_m > 0)
    text += fmt::format("tags on both sides of boards of {:.1f} mm\n", 1e3 * world.tag_board_m);
  for (const std::string& light : report.lights)
    text += fmt::format("light {} (not kept: the light is that of --set camera.…)\n", light);
  return text + fmt::format("Look at it: waymark world check {}\n", shell_word(file));
}

nlohmann::ordered_json to_json(const ImportWorldReport& report, const std::string& file) {
  return {{"file", file},
          {"tags", report.world.tags.tags.size()},
          {"furniture", report.world.occluders.size()},
          {"two_sided_board_m", report.world.tag_board_m},
          {"lights", report.lights},
          {"warnings", report.warnings}};
}

}  // namespace waymark
