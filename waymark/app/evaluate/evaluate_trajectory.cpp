#include "waymark/app/evaluate/evaluate_trajectory.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/figure_files.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/evaluation/dead_reckoning.hpp"
#include "waymark/plot/loop_figures.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

Duration duration_of(double seconds) { return Duration(static_cast<std::int64_t>(seconds * 1e9)); }

EstimatedTrajectory within(const EstimatedTrajectory& poses, SensorTime from, SensorTime to) {
  EstimatedTrajectory kept;
  for (const EstimatedPose& pose : poses)
    if (pose.stamp >= from && pose.stamp <= to) kept.push_back(pose);
  return kept;
}

Result<TrajectoryRow> score_row(const std::string& name, EstimatedTrajectory poses,
                                const EvaluationInputs& inputs, const TrajectoryReport& report) {
  TrajectoryRow row{.name = name, .poses = std::move(poses)};
  row.path = score_path(row.poses, inputs.reference.path);
  if (inputs.reference.timed.empty()) return row;
  if (row.path) row.path->side_m = {};  // a driven way has no sides
  const auto pairs = pair_by_time(row.poses, inputs.reference.timed, duration_of(report.options.max_gap_s));
  const Result<TrajectoryScores> scores = score_trajectory(pairs, report.alignment, report.options);
  if (!scores) return tl::unexpected(scores.error());
  row.pairs = pairs.size();
  row.scores = *scores;
  row.jumps = scores->jumps;
  return row;
}

/// Errors without alignment say little where the two trajectories stand in different frames, as where a map
/// begins where its lap did.
void tell_of_frames(const TrajectoryRow& row, const EvaluationInputs& inputs, const TrajectoryReport& report,
                    const JobControl& control) {
  constexpr double kLarge_m = 0.05;
  constexpr double kMostOfIt = 0.25;
  if (!row.scores || report.alignment != AlignmentKind::None || row.scores->ate_m.rmse < kLarge_m) return;
  const auto pairs = pair_by_time(row.poses, inputs.reference.timed, duration_of(report.options.max_gap_s));
  const auto aligned = score_trajectory(pairs, AlignmentKind::Se2, report.options);
  if (!aligned || aligned->ate_m.rmse > kMostOfIt * row.scores->ate_m.rmse) return;
  control.note(
      fmt::format("aligned (--alignment se2) the ATE is {:.4f} m: where EST and REF stand in different "
                  "frames, as where a "
                  "map begins where its lap did, that is the error",
                  aligned->ate_m.rmse));
}

/// When something was there to be known: the reference, else the odometry.
std::optional<std::pair<SensorTime, SensorTime>> knowable(const EvaluationInputs& inputs) {
  if (!inputs.reference.timed.empty())
    return std::pair(inputs.reference.timed.front().stamp, inputs.reference.timed.back().stamp);
  if (!inputs.motion.odometry.empty())
    return std::pair(inputs.motion.odometry.front().stamp, inputs.motion.odometry.back().stamp);
  return std::nullopt;
}

/// The first estimate at whose time there is odometry, of those of the first second: a picture may come
/// before it.
std::optional<StampedPose> common_start(const EstimatedTrajectory& estimate, const Trajectory& wheels) {
  constexpr Duration kMost = std::chrono::seconds(1);
  for (const EstimatedPose& pose : estimate) {
    if (pose.stamp - estimate.front().stamp > kMost) break;
    if (pose_at(wheels, pose.stamp, Duration::max())) return StampedPose{pose.stamp, pose.map_T_base};
  }
  return std::nullopt;
}

/// The rows of dead reckoning, from where the estimate begins to where it ends.
Status add_dead_reckoning(const EvaluationInputs& inputs, TrajectoryReport& report) {
  const EstimatedTrajectory estimate = report.rows.front().poses;
  const Trajectory wheels = wheel_odometry(inputs.motion.odometry);
  const Trajectory gyro = gyro_odometry(inputs.motion.odometry, inputs.motion.imu);
  if (!report.rows.front().jumps && !wheels.empty())
    report.rows.front().jumps =
        count_jumps(pair_by_time(estimate, wheels, duration_of(report.options.max_gap_s)), report.options);
  if (wheels.empty()) return {};
  const std::optional<StampedPose> start = common_start(estimate, wheels);
  if (!start)
    return fail(ErrorCode::InvalidArgument, "the odometry does not cover the time at which EST begins",
                {.key = "--odometry"}, "Give a recording of the same drive, on the same clock.");
  for (const auto& [name, trajectory] :
       {std::pair("odometry", &wheels), std::pair("odometry with gyro", &gyro)}) {
    EstimatedTrajectory placed = within(placed_at(*trajectory, *start), start->stamp, estimate.back().stamp);
    if (placed.empty()) continue;
    Result<TrajectoryRow> row = score_row(name, std::move(placed), inputs, report);
    if (!row) return tl::unexpected(row.error());
    report.rows.push_back(std::move(*row));
  }
  return {};
}

Trajectory plain(const EstimatedTrajectory& poses, const Alignment& alignment) {
  Trajectory trajectory;
  for (const EstimatedPose& pose : poses) trajectory.push_back({pose.stamp, alignment(pose.map_T_base)});
  return trajectory;
}

Trajectory drawn_reference(const Reference& reference) {
  if (!reference.timed.empty()) return reference.timed;
  Trajectory outline;
  for (const Eigen::Vector2d& corner : reference.path.corners)
    outline.push_back({{}, SE3(SO3(), {corner.x(), corner.y(), 0})});
  if (reference.path.closed) outline.push_back(outline.front());
  return outline;
}

}  // namespace

Result<EvaluationInputs> read_evaluation(const EvaluateTrajectoryJob& job, const JobControl& control) {
  EvaluationInputs inputs;
  Result<EstimatedTrajectory> estimate = read_estimate(job.estimate, job.estimate_topic, control);
  if (!estimate) return tl::unexpected(estimate.error());
  inputs.estimate = std::move(*estimate);
  Result<Reference> reference = read_reference(job.reference, job.reference_topic, job.closed, control);
  if (!reference) return tl::unexpected(reference.error());
  inputs.reference = std::move(*reference);
  for (StampedPose& pose : inputs.reference.timed) pose.stamp += duration_of(job.time_offset_s);
  if (!job.odometry.empty()) {
    Result<Motion> motion = read_motion(job.odometry, control);
    if (!motion) return tl::unexpected(motion.error());
    inputs.motion = std::move(*motion);
  }
  if (!job.map.empty()) {
    const Result<MapFile> map = read_map(job.map);
    if (!map) return tl::unexpected(map.error());
    inputs.tags = map->tags;
  }
  return inputs;
}

Status check_effects(const EvaluateTrajectoryJob& job, const Reference* reference, const GivenFlags& given) {
  const bool known = reference != nullptr;
  FlagRefusals refused(given);
  refused.flags(job.figures.empty(), {"--map"}, "no figure is drawn", "Add --figures, or leave it out.");
  refused.flags(known && reference->timed.empty(), {"--alignment", "--time-offset-s"},
                "of REF only the path is known, and no times", "Leave it out.");
  refused.flags(known && !reference->timed.empty(), {"--closed"},
                "REF says when the robot was where: a loop needs no closing", "Leave it out.");
  return refused.status();
}

Result<TrajectoryReport> evaluate_trajectory(const EvaluateTrajectoryJob& job, const EvaluationInputs& inputs,
                                             const JobControl& control) {
  const std::optional<AlignmentKind> alignment = alignment_kind(job.alignment);
  if (!alignment)
    return fail(ErrorCode::InvalidArgument, fmt::format("'{}' is no alignment", job.alignment),
                {.key = "alignment"}, "There are none, se2, se3 and sim3.");
  TrajectoryReport report{
      .estimate = job.estimate, .reference = job.reference, .alignment = *alignment, .options = job.scoring};
  const SensorTime begin = inputs.estimate.front().stamp;
  EstimatedTrajectory chosen =
      within(inputs.estimate, begin + duration_of(job.from_s), begin + duration_of(job.to_s));
  if (chosen.empty())
    return fail(ErrorCode::NotFound, "no estimate between --from and --to", {.source = job.estimate},
                fmt::format("It lasts {:.1f} s.", to_seconds(inputs.estimate.back().stamp - begin)));
  if (const auto when = knowable(inputs)) {
    const SensorTime from = std::max(when->first, job.from_s > 0 ? chosen.front().stamp : when->first);
    const SensorTime to = std::min(when->second, begin + duration_of(job.to_s));
    report.coverage = covered_share(chosen, from, to, duration_of(report.options.max_gap_s));
    report.time_to_first_fix_s = to_seconds(begin - when->first);
  }
  report.nis = read_nis(job.estimate, chosen.front().stamp, chosen.back().stamp, control);
  report.uncertain = count_uncertain(job.estimate, job.from_s > 0 ? chosen.front().stamp : SensorTime::min(),
                                     begin + duration_of(job.to_s), control);
  Result<TrajectoryRow> row = score_row("estimate", std::move(chosen), inputs, report);
  if (!row) return tl::unexpected(row.error());
  tell_of_frames(*row, inputs, report, control);
  report.rows.push_back(std::move(*row));
  if (const Status added = add_dead_reckoning(inputs, report); !added) return tl::unexpected(added.error());
  return report;
}

Result<std::vector<std::string>> write_evaluation_figures(const EvaluationInputs& inputs,
                                                          const TrajectoryReport& report,
                                                          const std::string& folder_name) {
  std::vector<std::string> files;
  constexpr plot::Color kOdometryColor = plot::kTaughtColor;
  std::error_code failed;
  fs::create_directories(folder_name, failed);
  std::vector<plot::PathLayer> layers;
  layers.push_back({.name = inputs.reference.timed.empty() ? "path" : "truth",
                    .path = drawn_reference(inputs.reference),
                    .tags = inputs.tags,
                    .color = plot::kTruthColor});
  for (auto row = report.rows.rbegin(); row != report.rows.rend(); ++row) {
    const bool estimate = row->name == "estimate";
    const Alignment alignment = row->scores ? row->scores->alignment : Alignment{};
    layers.push_back({.name = row->name,
                      .path = plain(row->poses, alignment),
                      .color = estimate                  ? plot::kEstimateColor
                               : row->name == "odometry" ? kOdometryColor
                                                         : plot::kPalette[6]});
  }
  const fs::path folder = folder_name;
  if (Status status = write_figure(folder / "trajectories", plot::path_figure("Seen from above", layers),
                                   {".svg", ".png"}, files);
      !status)
    return tl::unexpected(status.error());
  if (inputs.reference.timed.empty()) return files;
  const plot::Figure errors = plot::trajectory_error_figure("Distance of the estimate from the truth",
                                                            layers.back().path, inputs.reference.timed);
  if (Status status = write_figure(folder / "position_error", errors, {".svg", ".png"}, files); !status)
    return tl::unexpected(status.error());
  return files;
}

}  // namespace waymark
