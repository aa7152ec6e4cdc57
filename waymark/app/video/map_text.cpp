#include "waymark/app/video/map_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "waymark/base/angles.hpp"
#include "waymark/base/counted.hpp"
#include "waymark/replay/lap_closing.hpp"

namespace waymark {
namespace {

/// What of the lap a gyro covered, where there is one that is missing somewhere.
std::string gyro_in_words(const BundleFigures& b) {
  constexpr double kWorthSaying = 0.005;
  if (b.without_gyro_share < kWorthSaying || b.without_gyro_share == 1) return {};
  const char* what = b.turns_by_gyro ? "turns there are those of the wheels, with a scale of their own"
                                     : "turns are those of the odometry all along";
  return fmt::format("the gyro is missing from {:.0f} % of the lap: {}\n", 100 * b.without_gyro_share, what);
}

/// How much of the lap the route does not hold, if that is more than the usual overlap.
std::string repetition_in_words(const MappedLap& lap) {
  if (lap.route_repeated_m <= kUsualOverlap_m) return {};
  return fmt::format("the last {:.2f} m of the lap repeat the route and are not part of it\n",
                     lap.route_repeated_m);
}

}  // namespace

std::string to_text(const MapReport& report, const std::string& folder) {
  const MappedLap& lap = report.lap;
  std::string text = fmt::format("{}: {} tags from {} frames by method {}; {} route of {:.2f} m\n", folder,
                                 lap.map.tags.size(), lap.frames, report.method,
                                 lap.route.closed ? "closed" : "open", lap.route.length_m);
  text += repetition_in_words(lap);
  if (report.tag_errors) {
    const TagMapErrors& e = *report.tag_errors;
    text += fmt::format(
        "against the truth, anchored, not aligned:\n"
        "  tags        {:.3f} m rmse, {:.3f} m worst, {:.2f} deg rmse ({} of {})\n",
        e.rmse_m, e.max_m, e.orientation_rmse_deg, e.tags, e.tags + e.missing.size());
  }
  if (report.trajectory_errors && !report.tag_errors)
    text += report.truth_aligned
                ? "against the true trajectory, after alignment (where the anchor stands was not told):\n"
                : "against the true trajectory, not aligned:\n";
  if (report.trajectory_errors)
    text += fmt::format("  trajectory  {:.3f} m rmse, {:.3f} m worst\n", report.trajectory_errors->rmse_m,
                        report.trajectory_errors->max_m);
  if (lap.bundle) {
    const BundleFigures& b = *lap.bundle;
    text += fmt::format(
        "corners within {:.2f} px (rms); the farthest tag moved {:.3f} m from where the chain had it\n",
        b.rms_px, b.moved_m);
    if (b.odometry_scales_sigma.distance > 0)
      text += fmt::format(
          "what the wheels say must be multiplied by {:.4f} +- {:.4f} (distances) and {:.3f} +- {:.3f} "
          "(turns)\n",
          b.odometry_scales.distance, b.odometry_scales_sigma.distance, b.odometry_scales.yaw,
          b.odometry_scales_sigma.yaw);
    text += gyro_in_words(b);
  }
  if (lap.bundle && lap.bundle->loop) {
    const LoopClosure& loop = *lap.bundle->loop;
    text += fmt::format(
        "the way closes at {} after {:.1f} m: the wheels alone would be {:.3f} m and {:.1f} deg off there, "
        "adjusted its observations agree within {:.3f} m\n",
        to_string(loop.tag), loop.way_m, loop.before_m, to_degrees(loop.before_rad), loop.after_m);
  }
  if (report.poses) {
    const PoseLapFigures& p = *report.poses;
    text += fmt::format(
        "observations within {:.3f} m (rms); wheels to be multiplied by {:.4f} +- {:.4f} (distances) and "
        "{:.3f} "
        "+- "
        "{:.3f} (turns)\n",
        p.rms_m, p.scales.distance, p.scales_sigma.distance, p.scales.yaw, p.scales_sigma.yaw);
  }
  if (report.prior_agreeing)
    text +=
        fmt::format("{} tags stand where the prior map has them, within {:.3f} m (rms, after alignment)\n",
                    *report.prior_agreeing, report.prior_rms_m);
  if (lap.bundle && report.extends)
    text += fmt::format("{} tags agree with the map that is extended\n", lap.bundle->prior_agreeing);
  if (!report.set_aside.empty())
    text += fmt::format("what stood there before has a number in its name now: {}\n",
                        fmt::join(report.set_aside, ", "));
  return text;
}

std::string to_text(const MapSceneReport& report, const std::string& folder) {
  const nlohmann::ordered_json json = to_json(report);
  std::string text =
      fmt::format("{}: {} tags from {} observations in {} frames\n", folder, json["tags"].get<std::size_t>(),
                  report.map.observations.seen.size(), report.frames);
  text += fmt::format("corners within {:.3f} px (mean; median {:.3f}), noise {:.3f} px, cost {:.2f}\n",
                      report.map.reprojection_mean_px, report.map.reprojection_median_px, report.map.noise_px,
                      report.map.cost);
  if (report.against)
    text += fmt::format(
        "the other solution costs {:.2f} in TagSLAM's model: ours differs by {:+.2f} % (compare with --model "
        "tagslam)\n",
        report.against->cost, 100 * (report.map.cost / report.against->cost - 1));
  return text;
}

std::string to_text(const MapVideoReport& report, const std::string& folder) {
  std::string text =
      fmt::format("{}: {} from {} ({} with a pose)\n", folder, counted(report.file.tags.tags.size(), "tag"),
                  counted(report.pictures, "picture"), report.trajectory.size());
  text += fmt::format(
      "corners within {:.2f} px (mean), noise {:.2f} px; {:.1f} successive pictures count as one\n",
      report.map.reprojection_mean_px, report.map.noise_px, report.map.correlated_frames);
  for (const FoundIntrinsics& lens : report.map.intrinsics)
    text += fmt::format("focal length {:.1f} +- {:.1f} px (given {:.1f} +- {:.1f})\n", lens.found[0],
                        lens.sigma[0], lens.given[0], lens.prior_sigma[0]);
  if (!report.measured.empty())
    text += fmt::format("tags are {:.4f} +- {:.4f} times as large as given\n", report.map.size_scale,
                        report.map.size_sigma);
  for (const MeasuredResidual& d : report.measured)
    text += fmt::format("{} to {}: {:.4f} m in the map, measured {:.4f} m, {:+.1f} sigma\n",
                        to_string(d.given.a), to_string(d.given.b), d.found_m, d.given.measured_m,
                        (d.found_m - d.given.measured_m) / d.given.sigma_m);
  text += "  tag                   x m      y m      z m   sigma x  sigma y  sigma z m  pictures\n";
  for (const auto& [id, tag] : report.file.tags.tags) {
    const Eigen::Vector3d& p = tag.map_T_tag.translation();
    const Eigen::Vector3d s = position_sigma_m(tag);
    text += fmt::format("  {:<16}{:>9.4f}{:>9.4f}{:>9.4f}{:>10.4f}{:>9.4f}{:>9.4f}{:>12}{}\n", to_string(id),
                        p.x(), p.y(), p.z(), s.x(), s.y(), s.z(), report.file.observations.at(id),
                        id == report.file.anchor ? "   anchor" : "");
  }
  for (const TagBesidePrior& tag : report.beside)
    text += fmt::format(
        "{} stands {:+.4f} {:+.4f} {:+.4f} m (x y z) from where the prior map has it, turned {:.1f} deg\n",
        to_string(tag.tag), tag.off_m.x(), tag.off_m.y(), tag.off_m.z(), to_degrees(tag.turned_rad));
  return text;
}

}  // namespace waymark
