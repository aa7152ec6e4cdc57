#include <cmath>

#include <fmt/format.h>

#include "waymark/app/evaluate/report_page.hpp"
#include "waymark/evaluation/map_errors.hpp"
#include "waymark/evaluation/tag_reprojection.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/pipeline/lap_mapper.hpp"
#include "waymark/plot/loop_figures.hpp"

namespace waymark {
namespace {

using Rows = std::vector<std::vector<std::string>>;

std::string millimetres(double metres) { return fmt::format("{:.1f}", 1000 * metres); }

/// Standard deviation in the direction in which the tag's centre is known worst.
std::string sigma_mm(const MappedTag& tag) {
  if (!tag.covariance) return "-";
  const double variance_m2 = symmetric_eigenvalues<3>(tag.covariance->topLeftCorner<3, 3>())[2];
  return millimetres(std::sqrt(std::max(0.0, variance_m2)));
}

/// What the lap the map was made of says about it.
struct MadeOf {
  std::optional<World> world{};
  std::optional<MappedLap> chain{};  ///< the map before it was optimised
  std::map<TagId, TagReprojection> residuals{};
};

/// The figure of residuals is one picture: that of the first camera.
std::vector<TagFrame> frames_of_first_camera(const RecordedLap& lap) {
  std::vector<TagFrame> frames = lap.frames;
  std::erase_if(frames, [&](const TagFrame& frame) {
    const auto& others = lap.setup.more_cameras;
    return std::ranges::find(others, frame.camera, &MountedCamera::name) != others.end();
  });
  return frames;
}

MadeOf look_back(const MapRun& run, const DriveRun& drive, const JobControl& control) {
  MadeOf made;
  if (Result<std::optional<World>> world = true_world(drive.lap); world) made.world = std::move(*world);
  const auto& setup = drive.lap.setup;
  if (setup.camera && setup.base_T_cam)
    made.residuals = tag_reprojection(frames_of_first_camera(drive.lap), run.map.tags, run.trajectory,
                                      *setup.camera, *setup.base_T_cam);
  const Result<TeachSetup> teach = setup_of(drive.lap, {});
  if (!teach) return made;
  control.progress({"before optimisation: the chain of " + drive.file});
  Result<MappedLap> chain =
      map_lap({drive.lap.frames, drive.lap.odometry}, *teach, {.method = MapMethod::Chain});
  if (chain) made.chain = std::move(*chain);
  return made;
}

plot::PageTable tag_table(const MapRun& run, const MadeOf& made) {
  plot::PageTable table{.caption = "Tags",
                        .head = {"tag", "x [m]", "y [m]", "z [m]", "size [m]", "observations", "sigma [mm]",
                                 "residual [px]", "worst [px]", "seen from [m]", "error [mm]"}};
  for (const auto& [id, tag] : run.map.tags.tags) {
    const Eigen::Vector3d& p = tag.map_T_tag.translation();
    const auto seen = run.map.observations.find(id);
    const auto residual = made.residuals.find(id);
    const bool known = residual != made.residuals.end();
    const MappedTag* truth = made.world ? made.world->tags.find(id) : nullptr;
    table.rows.push_back(
        {to_string(id), fmt::format("{:.3f}", p.x()), fmt::format("{:.3f}", p.y()),
         fmt::format("{:.3f}", p.z()), fmt::format("{:.3f}", tag.size_m),
         seen == run.map.observations.end() ? "-" : std::to_string(seen->second), sigma_mm(tag),
         known ? fmt::format("{:.2f}", residual->second.rms_px) : "-",
         known ? fmt::format("{:.2f}", residual->second.largest_px) : "-",
         known ? fmt::format("{:.1f} to {:.1f}", residual->second.nearest_m, residual->second.farthest_m)
               : "-",
         truth == nullptr ? "-" : millimetres((p - truth->map_T_tag.translation()).norm())});
  }
  return table;
}

std::vector<std::string> error_row(const char* name, const TagMap& map, const Trajectory& trajectory,
                                   const MadeOf& made, const Trajectory& truth) {
  const TagMapErrors tags = tag_map_errors(map, made.world->tags);
  const TrajectoryErrors way = trajectory_errors(trajectory, truth);
  return {name,
          millimetres(tags.rmse_m),
          millimetres(tags.max_m),
          fmt::format("{:.3f}", tags.orientation_rmse_deg),
          millimetres(way.rmse_m),
          millimetres(way.max_m)};
}

/// Only where map and world stand in the same place: the anchor tells.
bool same_frame(const MapRun& run, const MadeOf& made) {
  const MappedTag* truth = made.world ? made.world->tags.find(run.map.anchor) : nullptr;
  const MappedTag* mapped = run.map.tags.find(run.map.anchor);
  return truth != nullptr && mapped != nullptr && in_frame_of_truth(mapped->map_T_tag, truth->map_T_tag);
}

void add_before_and_after(const MapRun& run, const DriveRun& drive, const MadeOf& made,
                          plot::PageSection& section) {
  if (!made.chain) return;
  const bool truth = same_frame(run, made);
  if (truth) {
    section.tables.push_back(
        {.caption = "Against the truth, anchored, not aligned",
         .head = {"", "tags, rmse [mm]", "worst [mm]", "rotation [deg]", "way, rmse [mm]", "worst [mm]"},
         .rows = {error_row("before (chain)", made.chain->map, made.chain->trajectory, made, drive.lap.truth),
                  error_row("after", run.map.tags, run.trajectory, made, drive.lap.truth)}});
  }
  std::vector<plot::PathLayer> layers;
  if (truth) layers.push_back({"truth", drive.lap.truth, made.world->tags, plot::kTruthColor});
  layers.push_back({"before (chain)", made.chain->trajectory, made.chain->map, plot::kTaughtColor});
  layers.push_back({"after", run.trajectory, run.map.tags, plot::kEstimateColor});
  section.figures.push_back({"before_after", plot::path_figure("Before and after optimisation", layers),
                             "The chain joins tags seen in one frame; the optimised map explains all "
                             "corners, wheels and the floor at once."});
}

}  // namespace

plot::PageSection map_section(const MapRun& run, const DriveRun* drive, const JobControl& control) {
  plot::PageSection section{.title = (run.folder / "map.yaml").string()};
  plot::PageTable facts{
      .rows = {{"tags", std::to_string(run.map.tags.tags.size())}, {"anchor", to_string(run.map.anchor)}}};
  for (const auto& [key, value] : run.map.provenance) facts.rows.push_back({key, value});
  if (run.route)
    facts.rows.push_back(
        {"route", fmt::format("{:.2f} m, {}", run.route->length_m, run.route->closed ? "closed" : "open")});
  section.tables.push_back(std::move(facts));
  const MadeOf made = drive != nullptr ? look_back(run, *drive, control) : MadeOf{};
  if (drive == nullptr)
    section.words.emplace_back(
        "The recording it was made of was not given: no residuals, nothing to compare it with.");
  if (drive != nullptr) add_before_and_after(run, *drive, made, section);
  section.tables.push_back(tag_table(run, made));
  const std::vector<plot::PathLayer> layers = {{"map", run.trajectory, run.map.tags, plot::kEstimateColor}};
  section.figures.push_back({"map", plot::path_figure("Map", layers), ""});
  if (drive != nullptr && same_frame(run, made) && !run.trajectory.empty())
    section.figures.push_back(
        {"map_error",
         plot::trajectory_error_figure("Error of the mapped way", run.trajectory, drive->lap.truth), ""});
  return section;
}

}  // namespace waymark
