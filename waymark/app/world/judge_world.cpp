#include "waymark/app/world/judge_world.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>

#include <fmt/format.h>

#include "waymark/app/common/output_files.hpp"
#include "waymark/plot/render.hpp"
#include "waymark/plot/run_figures.hpp"

namespace waymark {
namespace {

/// Plausible sizes of printed tags. Other sizes were probably given in the wrong unit.
constexpr double kSmallestTagMetres = 0.01;
constexpr double kLargestTagMetres = 2;
constexpr std::size_t kMaxListed = 5;

/// One warning per pair of overlapping tags. After kMaxListed warnings, only the number of remaining pairs is
/// given.
std::vector<std::string> overlap_warnings(const WorldCheck& check) {
  std::vector<std::string> warnings;
  for (const auto& [a, b] : check.overlapping) {
    if (warnings.size() == kMaxListed) {
      warnings.push_back(fmt::format("{} more pairs of tags overlap", check.overlapping.size() - kMaxListed));
      break;
    }
    warnings.push_back(fmt::format("{} and {} overlap; move one of them", to_string(a), to_string(b)));
  }
  return warnings;
}

/// Warnings about probable mistakes.
std::vector<std::string> warnings_about(const World& world, const WorldCheck& check) {
  for (const auto& [id, tag] : world.tags.tags) {
    const double size = tag.size_m;
    if (size >= kSmallestTagMetres && size <= kLargestTagMetres) continue;
    return {fmt::format("the size of {} is {:g} m: {}", to_string(id), size,
                        size > kLargestTagMetres ? "sizes are in metres, not millimetres"
                                                 : "too small to detect; sizes are in metres")};
  }
  return overlap_warnings(check);
}

Trajectory as_trajectory(const std::vector<SE3>& poses) {
  Trajectory trajectory;
  for (const SE3& pose : poses) trajectory.push_back({SensorTime(Duration(trajectory.size())), pose});
  if (!trajectory.empty()) trajectory.push_back(trajectory.front());  // close the circle
  return trajectory;
}

/// Optical (z) axes for about twelve of the camera poses, as line segments.
plot::Series view_axes(const std::vector<SE3>& map_T_cam, double length_m, plot::Color color) {
  plot::Series series{.name = "", .color = color};
  for (std::size_t i = 0; i < map_T_cam.size(); i += std::max<std::size_t>(map_T_cam.size() / 12, 1)) {
    for (const double z : {0.0, length_m, std::nan("")}) {
      const Eigen::Vector3d p = map_T_cam[i] * Eigen::Vector3d(0, 0, z);
      series.x.push_back(p.x());
      series.y.push_back(p.y());
    }
  }
  return series;
}

/// The tags that are hidden over the longest parts of the line.
std::string hidden_to_text(std::vector<HiddenTag> hidden) {
  std::ranges::stable_sort(hidden, std::ranges::greater{}, &HiddenTag::from_m);
  std::string text;
  for (std::size_t i = 0; i < std::min(hidden.size(), kMaxListed); ++i)
    text += fmt::format("hidden                     {} behind {}, over {:.2f} m of the line\n",
                        to_string(hidden[i].tag), to_string(hidden[i].by), hidden[i].from_m);
  if (hidden.size() > kMaxListed)
    text += fmt::format("                           and {} more pairs\n", hidden.size() - kMaxListed);
  return text;
}

struct HiddenLine {
  HiddenTag hidden{};
};

ReportFields fields(const HiddenLine& line) {
  return {{"tag", "Tag that is hidden", to_string(line.hidden.tag)},
          {"by", "Tag in front of it", to_string(line.hidden.by)},
          {"from_m", "Length of the part of the line along which it is hidden", line.hidden.from_m}};
}

}  // namespace

Result<WorldVerdict> judge_world(const World& world, const RobotModel& robot, const CameraModel& camera,
                                 const TagCameraOptions& tag_camera) {
  const Result<WorldCheck> check = check_world(world, robot, camera, tag_camera);
  if (!check) return tl::unexpected(check.error());
  WorldVerdict verdict{.world = world.name,
                       .robot = robot.name,
                       .tags = world.tags.tags.size(),
                       .check = *check,
                       .warnings = warnings_about(world, *check)};
  verdict.good = verdict.warnings.empty() && check->min_clearance_m >= kGoodLapClearance_m &&
                 check->two_tags_fraction >= kGoodLapTwoTags;
  return verdict;
}

std::string nearest_tag(const WorldCheck& c) { return c.nearest_tag ? to_string(*c.nearest_tag) : "no tag"; }

ReportFields fields(const WorldVerdict& verdict) {
  const WorldCheck& c = verdict.check;
  std::vector<std::array<std::string, 2>> overlapping;
  for (const auto& [a, b] : c.overlapping) overlapping.push_back({to_string(a), to_string(b)});
  const std::vector<HiddenLine> hidden(c.hidden.begin(), c.hidden.end());
  return {{"world", "Name of the world", verdict.world},
          {"robot", "Name of the robot", verdict.robot},
          {"tags", "Number of tags", verdict.tags},
          {"lap_m", "Length of the line", c.lap_m},
          {"min_clearance_m", "Smallest distance in space from the hull to a tag; null without tags",
           c.min_clearance_m},
          {"nearest_tag", "Name of that tag, or `no tag`", nearest_tag(c)},
          {"two_tags_fraction", "Fraction of the line along which two or more tags are in view",
           c.two_tags_fraction},
          {"fewest_tags", "Smallest number of tags in view at any point of the line", c.fewest_tags},
          {"sharpest_left_1_m", "Largest curvature to the left", c.sharpest_left_1_m},
          {"sharpest_right_1_m", "Largest curvature to the right", c.sharpest_right_1_m},
          {"overlapping_tags", "Pairs of tags that overlap", overlapping},
          {"hidden_tags", "Tags that other tags hide along a part of the line", hidden},
          {"warnings", "Warnings: invalid tag sizes, overlapping tags", verdict.warnings},
          {"good", "Whether the world allows a good lap", verdict.good}};
}

Status write_orbit(const std::string& path, const World& world, const OrbitReport& report) {
  plot::Figure figure =
      plot::path_figure("Camera on a circle around the tags",
                        {{"as placed", as_trajectory(report.map_T_cam), world.tags, plot::kTruthColor},
                         {"composed, with noise", as_trajectory(report.map_T_cam_composed),
                          report.tags_composed, plot::kEstimateColor}});
  figure.series.push_back(view_axes(report.map_T_cam, report.radius_m / 8, plot::kTruthColor));
  figure.series.push_back(view_axes(report.map_T_cam_composed, report.radius_m / 8, plot::kEstimateColor));
  const Result<plot::FileFormat> format = plot::format_of(path);
  if (!format) return tl::unexpected(format.error());
  std::vector<std::string> files;
  return write_figure(path, figure, {std::filesystem::path(path).extension().string()}, files);
}

ReportFields fields(const WorldOrbit& report) {
  const OrbitReport& r = report.orbit;
  return {
      {"world", "Name of the world", report.world},
      {"steps", "Number of poses on the circle", r.map_T_cam.size()},
      {"radius_m", "Radius of the circle", r.radius_m},
      {"closure", "Without noise: largest |log| of the transform loops, which should be the identity",
       r.closure},
      {"jump_m",
       "With noise: largest translation of a composed frame in one step, minus the nominal translation",
       r.jump_m},
      {"jump_limit_m", "Six standard deviations of the jump due to noise", r.jump_limit_m},
      {"jump_deg", "With noise: largest rotation of a composed frame in one step, minus the nominal rotation",
       r.jump_deg},
      {"jump_limit_deg", "Six standard deviations of the jump due to noise", r.jump_limit_deg},
      {"smallest_axis_cosine",
       "With noise: smallest cosine between an axis of a composed frame and the nominal axis",
       r.smallest_axis_cosine},
      {"good", "Whether all loops close, no frame jumps and no axis is inverted",
       r.closes() && r.continuous() && r.upright()}};
}

std::string to_text(const WorldVerdict& verdict, const World& world, const RobotModel& robot) {
  const WorldCheck& c = verdict.check;
  return fmt::format(
      "{}: {} tags, {} of {:.2f} m, driven exactly by the robot {}\n"
      "hull to the nearest tag    {:.3f} m ({} from x {:.2f} m, y {:.2f} m; required: {} m)\n"
      "two or more tags in view   {:.1f} % of the line (required: {:.0f} %); never fewer than {}\n"
      "sharpest curves            {:.2f} 1/m to the left, {:.2f} 1/m to the right\n{}",
      world.name, world.tags.tags.size(), world.path_closed ? "a lap" : "an open line", c.lap_m, robot.name,
      c.min_clearance_m, nearest_tag(c), c.nearest_place_m.x(), c.nearest_place_m.y(), kGoodLapClearance_m,
      100 * c.two_tags_fraction, 100 * kGoodLapTwoTags, c.fewest_tags, c.sharpest_left_1_m,
      c.sharpest_right_1_m, hidden_to_text(c.hidden));
}

std::string to_text(const OrbitReport& r, const World& world) {
  const auto verdict = [](bool good) { return good ? "yes" : "NO"; };
  return fmt::format(
      "{}: {} steps on a circle of radius {:.2f} m around {} tags\n"
      "without noise  loops close to {:.1e} (below 1e-12: {})\n"
      "with noise     largest jump {:.3f} m (limit from noise: {:.3f} m), {:.2f} deg (limit {:.2f} deg; no "
      "discontinuity: {})\n"
      "               smallest cosine between an axis and its nominal axis {:.4f} (no inversion: {})\n",
      world.name, r.map_T_cam.size(), r.radius_m, world.tags.tags.size(), r.closure, verdict(r.closes()),
      r.jump_m, r.jump_limit_m, r.jump_deg, r.jump_limit_deg, verdict(r.continuous()), r.smallest_axis_cosine,
      verdict(r.upright()));
}

}  // namespace waymark
