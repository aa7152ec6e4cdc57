#include "waymark/app/evaluate/evaluate_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/evaluation/dead_reckoning.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/plot/run_figures.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/sample_recorder.hpp"

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
  if (row.path) row.path->side_m = {};  // undefined for the trajectory of a drive
  const auto pairs = pair_by_time(row.poses, inputs.reference.timed, duration_of(report.options.max_gap_s));
  if (pairs.empty() && !row.poses.empty()) {
    const auto span = [](const auto& timed) {
      return fmt::format("{:.3f} to {:.3f} s", to_seconds(timed.front().stamp.time_since_epoch()),
                         to_seconds(timed.back().stamp.time_since_epoch()));
    };
    return fail(
        ErrorCode::NotFound,
        fmt::format("no pose is at a time covered by the reference: the {} covers {}, the reference {}", name,
                    span(row.poses), span(inputs.reference.timed)),
        {}, "Check that both are from the same drive and use the same clock.");
  }
  const Result<TrajectoryScores> scores = score_trajectory(pairs, report.alignment, report.options);
  if (!scores) return tl::unexpected(scores.error());
  row.pairs = pairs.size();
  row.scores = *scores;
  row.jumps = scores->jumps;
  return row;
}

/// Prints the ATE after alignment if it is much smaller than before. In that case the two trajectories may
/// have different frames, for example because the map frame is defined by the start of the lap.
void note_frame_difference(const TrajectoryRow& row, const EvaluationInputs& inputs,
                           const TrajectoryReport& report, const JobControl& control) {
  constexpr double kLarge_m = 0.05;
  constexpr double kMaxRatio = 0.25;  // ratio of the ATE after alignment to that before alignment
  if (!row.scores || report.alignment != AlignmentKind::None || row.scores->ate_m.rmse < kLarge_m) return;
  const auto pairs = pair_by_time(row.poses, inputs.reference.timed, duration_of(report.options.max_gap_s));
  const auto aligned = score_trajectory(pairs, AlignmentKind::Se2, report.options);
  if (!aligned || aligned->ate_m.rmse > kMaxRatio * row.scores->ate_m.rmse) return;
  control.note(
      fmt::format("with `alignment=se2` the ATE is {:.4f} m. This is the actual error if EST and REF have "
                  "different frames, for example because the map frame is that of the start of the lap",
                  aligned->ate_m.rmse));
}

/// The interval in which estimates are expected: that of the reference or, without one, of the odometry.
std::optional<std::pair<SensorTime, SensorTime>> expected_interval(const EvaluationInputs& inputs) {
  if (!inputs.reference.timed.empty())
    return std::pair(inputs.reference.timed.front().stamp, inputs.reference.timed.back().stamp);
  if (!inputs.motion.odometry.empty())
    return std::pair(inputs.motion.odometry.front().stamp, inputs.motion.odometry.back().stamp);
  return std::nullopt;
}

/// The first estimate at a time covered by odometry. Only the first second is searched, because an image may
/// precede the first odometry sample.
std::optional<StampedPose> common_start(const EstimatedTrajectory& estimate, const Trajectory& wheels) {
  constexpr Duration kMaxDelay = std::chrono::seconds(1);
  for (const EstimatedPose& pose : estimate) {
    if (pose.stamp - estimate.front().stamp > kMaxDelay) break;
    if (pose_at(wheels, pose.stamp, Duration::max())) return StampedPose{pose.stamp, pose.map_T_base};
  }
  return std::nullopt;
}

/// Adds the rows for dead reckoning. It starts at the first pose of the estimate, and ends when the estimate
/// ends.
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
    return fail(ErrorCode::NotFound, "the odometry does not cover the start of EST", {},
                "Use a recording of the same drive with the same clock.");
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

Trajectory aligned_path(const EstimatedTrajectory& poses, const Alignment& alignment) {
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
    const Result<MapFile> map = or_wrong_kind(read_map(job.map), job.map, FileUse::OwnMap);
    if (!map) return tl::unexpected(map.error());
    inputs.tags = map->tags;
  }
  return inputs;
}

Status check_effects(const EvaluateTrajectoryJob& job, const Reference* reference, const GivenFields& given) {
  const bool known = reference != nullptr;
  FieldRefusals refused(given);
  refused.fields(job.figures.empty(), {"map"}, "no figure is drawn", "Add `figures`, or omit this option.");
  refused.fields(known && reference->timed.empty(), {"alignment", "time_offset_s"},
                 "REF contains only a path without times", "Omit this option.");
  refused.fields(known && !reference->timed.empty(), {"closed"},
                 "REF contains times, so its path is not closed", "Omit this option.");
  return refused.status();
}

Result<TrajectoryReport> evaluate_trajectory(const EvaluateTrajectoryJob& job, const EvaluationInputs& inputs,
                                             const JobControl& control) {
  const std::optional<AlignmentKind> alignment = alignment_kind(job.alignment);
  if (!alignment)
    return fail(ErrorCode::InvalidArgument, fmt::format("unknown alignment '{}'", job.alignment),
                {.key = "alignment"}, "Use none, se2, se3 or sim3.");
  TrajectoryReport report{
      .estimate = job.estimate, .reference = job.reference, .alignment = *alignment, .options = job.scoring};
  const SensorTime begin = inputs.estimate.front().stamp;
  EstimatedTrajectory chosen =
      within(inputs.estimate, begin + duration_of(job.from_s), begin + duration_of(job.to_s));
  if (chosen.empty())
    return fail(ErrorCode::NotFound, "no estimate between `from` and `to`", {.source = job.estimate},
                fmt::format("EST lasts {:.1f} s.", to_seconds(inputs.estimate.back().stamp - begin)));
  if (const auto interval = expected_interval(inputs)) {
    const SensorTime from =
        std::max(interval->first, job.from_s > 0 ? chosen.front().stamp : interval->first);
    const SensorTime to = std::min(interval->second, begin + duration_of(job.to_s));
    report.coverage = covered_share(chosen, from, to, duration_of(report.options.max_gap_s));
    report.time_to_first_fix_s = to_seconds(begin - interval->first);
  }
  report.nis = read_nis(job.estimate, chosen.front().stamp, chosen.back().stamp, control);
  report.uncertain = count_uncertain(job.estimate, job.from_s > 0 ? chosen.front().stamp : SensorTime::min(),
                                     begin + duration_of(job.to_s), control);
  Result<TrajectoryRow> row = score_row("estimate", std::move(chosen), inputs, report);
  if (!row) return tl::unexpected(row.error());
  note_frame_difference(*row, inputs, report, control);
  report.rows.push_back(std::move(*row));
  if (Status added = add_dead_reckoning(inputs, report); !added) {
    added.error().place = {.source = job.odometry};
    return tl::unexpected(added.error());
  }
  return report;
}

Result<std::vector<std::string>> write_evaluation_figures(const EvaluationInputs& inputs,
                                                          const TrajectoryReport& report,
                                                          const std::string& folder_name) {
  std::vector<std::string> files;
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
                      .path = aligned_path(row->poses, alignment),
                      .color = estimate                  ? plot::kEstimateColor
                               : row->name == "odometry" ? plot::kOdometryColor
                                                         : plot::kPalette[6]});
  }
  const fs::path folder = folder_name;
  if (Status status = write_figure(folder / "trajectories", plot::path_figure("Seen from above", layers),
                                   {".svg", ".png"}, files);
      !status)
    return tl::unexpected(status.error());
  if (inputs.reference.timed.empty()) return files;
  const plot::Figure errors = plot::trajectory_error_figure("Distance of the estimate from the ground truth",
                                                            layers.back().path, inputs.reference.timed);
  if (Status status = write_figure(folder / "position_error", errors, {".svg", ".png"}, files); !status)
    return tl::unexpected(status.error());
  return files;
}

// Conversion to report fields.
namespace {

double seconds_of(const EstimatedTrajectory& poses) {
  return poses.empty() ? 0 : to_seconds(poses.back().stamp - poses.front().stamp);
}

/// Adds rmse, mean, median, p95 and max with keys such as "ate_rmse_m" (if `name` is "ate" and `unit` is
/// "m").
void add_statistics(ReportFields& all, const std::string& name, const std::string& unit,
                    std::string_view sentence, const std::optional<ErrorStatistics>& statistics) {
  const auto add = [&](const char* what, double ErrorStatistics::*member) {
    all.push_back({fmt::format("{}_{}_{}", name, what, unit), sentence, part(statistics, member)});
  };
  add("rmse", &ErrorStatistics::rmse);
  add("mean", &ErrorStatistics::mean);
  add("median", &ErrorStatistics::median);
  add("p95", &ErrorStatistics::p95);
  add("max", &ErrorStatistics::max);
}

ReportFields fields_of_row(const TrajectoryRow& row, const TrajectoryScoreOptions& options) {
  const auto& s = row.scores;
  const auto relative = part(s, &TrajectoryScores::relative);
  ReportFields all = {
      {"name", "`estimate`; or dead reckoning, for comparison: `odometry`, `odometry with gyro`", row.name},
      {"poses", "Number of poses", row.poses.size()},
      {"paired", "Number of poses at times covered by REF", row.pairs},
      {"duration_s", "Time from the first pose to the last", seconds_of(row.poses)},
      {"scale", "Scale factor applied to the estimate (`sim3`)",
       part(part(s, &TrajectoryScores::alignment), &Alignment::scale)}};
  add_statistics(all, "ate", "m", "Distance between the positions at the same time, after alignment",
                 part(s, &TrajectoryScores::ate_m));
  add_statistics(all, "rotation", "deg", "Angle between the orientations at the same time",
                 part(s, &TrajectoryScores::rotation_deg));
  add_statistics(all, "heading", "deg", "Angle between the headings at the same time",
                 part(s, &TrajectoryScores::heading_deg));
  if (options.rpe_delta_m > 0)
    all.push_back({"rpe_delta_m", "Length of the motions that RPE compares", options.rpe_delta_m});
  else
    all.push_back({"rpe_delta_s", "Duration of the motions that RPE compares", options.rpe_delta_s});
  add_statistics(all, "rpe", "m", "Relative pose error (RPE), translation",
                 part(relative, &RelativeErrors::translation_m));
  add_statistics(all, "rpe", "deg", "Relative pose error (RPE), rotation",
                 part(relative, &RelativeErrors::rotation_deg));
  const auto sides = row.path && row.path->side_m.count > 0 ? row.path : std::nullopt;
  const auto consistency = part(s, &TrajectoryScores::consistency).value_or(std::nullopt);
  const auto usable = consistency && consistency->count > 0 ? consistency : std::nullopt;
  all.push_back({"end_error_m", "Error of the last pose", part(s, &TrajectoryScores::end_error_m)});
  add_statistics(all, "path", "m", "Distance from the nearest point of the path of REF",
                 part(row.path, &PathScores::distance_m));
  all.insert(
      all.end(),
      {{"side_rmse_m",
        "Signed distance from the part of REF with the same direction as the robot; left is positive",
        part(part(sides, &PathScores::side_m), &ErrorStatistics::rmse)},
       {"side_mean_m", "Mean signed distance", part(sides, &PathScores::side_mean_m)},
       {"end_to_start_m", "Distance from the first pose to the last", end_to_start_m(row.poses)},
       {"end_to_start_deg", "Rotation about the vertical axis from the first pose to the last",
        end_to_start_deg(row.poses)},
       {"nees_mean", "Normalised estimation error squared in x, y and yaw; 3 if the covariance is consistent",
        part(usable, &Consistency::nees_mean)},
       {"nees_median", "Median of the normalised estimation error squared",
        part(usable, &Consistency::nees_median)},
       {"inside_95", "Fraction of poses within their 95 % ellipsoids", part(usable, &Consistency::inside_95)},
       {"jumps",
        "Steps that differ from those of REF, or of the odometry, by more than `jump_m` or `jump_deg`",
        row.jumps}});
  return all;
}

/// A row for dead reckoning.
struct RowBeside {
  TrajectoryRow row{};
  TrajectoryScoreOptions options{};
};

ReportFields fields(const RowBeside& beside) { return fields_of_row(beside.row, beside.options); }

}  // namespace

double end_to_start_m(const EstimatedTrajectory& poses) {
  if (poses.empty()) return 0;
  return (poses.back().map_T_base.translation() - poses.front().map_T_base.translation()).norm();
}

double end_to_start_deg(const EstimatedTrajectory& poses) {
  if (poses.empty()) return 0;
  const SE3 start_T_end = poses.front().map_T_base.inverse() * poses.back().map_T_base;
  return to_degrees(project_to_plane(start_T_end).yaw());
}

ReportFields fields(const TrajectoryReport& report) {
  const auto nis = report.nis && report.nis->observations > 0 ? report.nis : std::nullopt;
  std::vector<RowBeside> beside;
  for (std::size_t i = 1; i < report.rows.size(); ++i) beside.push_back({report.rows[i], report.options});
  ReportFields all = {{"estimate", "File of EST", report.estimate},
                      {"reference", "File of REF", report.reference},
                      {"alignment", "none, se2, se3 or sim3", to_string(report.alignment)}};
  const ReportFields of_estimate =
      fields_of_row(report.rows.empty() ? TrajectoryRow{} : report.rows.front(), report.options);
  all.insert(all.end(), of_estimate.begin(), of_estimate.end());
  all.insert(
      all.end(),
      {{"nis_mean",
        "Mean normalised innovation squared per degree of freedom of an observation; 1 if the filter is "
        "consistent",
        part(nis, &NisSummary::mean)},
       {"observations", "Number of observations used for nis_mean",
        part(report.nis, &NisSummary::observations)},
       {"uncertain", "Number of estimates marked uncertain, which are not evaluated", report.uncertain},
       {"coverage",
        "Fraction of the duration of REF, or of the odometry, with an estimate within `max_gap_s`",
        report.coverage},
       {"time_to_first_fix_s", "Time from the first pose of REF, or of the odometry, to the first estimate",
        report.time_to_first_fix_s},
       {"beside", "With `odometry`: one entry for wheel odometry, one for wheel odometry with gyro",
        beside}});
  return all;
}

// Warnings about questionable comparisons.
namespace {

std::vector<Odometry> odometry_of(const std::string& path, const JobControl& control) {
  std::vector<Odometry> all;
  if (!is_recording(kind_of(path))) return all;
  const auto log = open_log(path, control.log_options());
  if (!log) return all;
  const Result<RecordingSetup> setup = (*log)->setup();
  if (!setup) return all;
  const Status read = (*log)->visit_samples((*log)->topics_used(*setup, false), [&](const Sample& sample) {
    if (const auto* odometry = std::get_if<Odometry>(&sample)) all.push_back(*odometry);
    return Status();
  });
  if (!read) all.clear();
  std::ranges::stable_sort(all, {}, &Odometry::stamp);
  return all;
}

/// Whether two recordings are from different drives. This is the case if their wheel odometry differs at the
/// same times.
bool different_drives(const std::string& a, const std::string& b, const JobControl& control) {
  constexpr double kTolerance = 1e-3;  // in metres or radians
  const std::vector<Odometry> first = odometry_of(a, control);
  if (first.empty() || a == b) return false;
  std::size_t common = 0;
  std::size_t different = 0;
  for (const Odometry& odometry : odometry_of(b, control)) {
    const auto at = std::ranges::lower_bound(first, odometry.stamp, {}, &Odometry::stamp);
    if (at == first.end() || at->stamp != odometry.stamp) continue;
    ++common;
    different += minus(at->odom_T_base, odometry.odom_T_base).norm() > kTolerance ? 1U : 0U;
  }
  return 2 * different > common;
}

/// RMS distance of the positions in a reference from their mean [m].
double spread_of(const Reference& reference) {
  std::vector<Eigen::Vector2d> positions = reference.path.corners;
  for (const StampedPose& pose : reference.timed)
    positions.emplace_back(pose.map_T_base.translation().head<2>());
  if (positions.empty()) return 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& position : positions) mean += position;
  mean /= static_cast<double>(positions.size());
  double squared = 0;
  for (const Eigen::Vector2d& position : positions) squared += (position - mean).squaredNorm();
  return std::sqrt(squared / static_cast<double>(positions.size()));
}

}  // namespace

std::vector<std::string> comparison_warnings(const TrajectoryReport& report, const Reference& reference,
                                             const JobControl& control) {
  std::vector<std::string> all;
  const TrajectoryRow& estimate = report.rows.front();
  if (estimate.scores && 2 * estimate.pairs < estimate.poses.size())
    all.push_back(
        fmt::format("REF covers the times of only {} of {} poses of EST. Are both from the same drive, with "
                    "the same clock?",
                    estimate.pairs, estimate.poses.size()));
  if (different_drives(report.estimate, report.reference, control))
    all.emplace_back(
        "EST and REF are recordings of different drives: their odometry differs at the same times. The "
        "errors are distances between the drives, not a measure of the accuracy of EST");
  double rmse_m = 0;
  if (estimate.scores) {
    rmse_m = estimate.scores->ate_m.rmse;
  } else if (estimate.path) {
    rmse_m = estimate.path->distance_m.rmse;
  }
  constexpr double kMinDistance_m = 0.3;
  constexpr double kMinRatio = 0.7;  // ratio of the error to the extent of REF
  if (report.alignment == AlignmentKind::None &&
      rmse_m > std::max(kMinDistance_m, kMinRatio * spread_of(reference)))
    all.push_back(
        fmt::format("EST is {:.1f} m from REF, which is about the extent of REF itself. Are both in the same "
                    "map frame? `alignment=se2` compares only their shapes",
                    rmse_m));
  return all;
}

// Output as a table.
namespace {

std::string metres(const std::optional<double>& value) { return value ? fmt::format("{:.4f}", *value) : "-"; }

std::string row_text(const TrajectoryRow& row) {
  const auto& s = row.scores;
  const auto& p = row.path;
  const auto of = [](const auto& scores, auto&& member) {
    return scores ? std::optional<double>(member(*scores)) : std::nullopt;
  };
  return fmt::format("{:<20}{:>7}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}\n", row.name, row.poses.size(),
                     metres(of(s, [](const auto& x) { return x.ate_m.rmse; })),
                     metres(of(s, [](const auto& x) { return x.ate_m.max; })),
                     s ? fmt::format("{:.3f}", s->heading_deg.rmse) : "-",
                     metres(of(s, [](const auto& x) { return x.relative.translation_m.rmse; })),
                     metres(of(p, [](const auto& x) { return x.distance_m.rmse; })),
                     metres(of(p, [](const auto& x) { return x.distance_m.max; })),
                     p && p->side_m.count > 0 ? fmt::format("{:.4f}", p->side_m.rmse) : "-");
}

std::string consistency_text(const Consistency& c) {
  if (c.count == 0) return "consistency: no covariance of the estimate is positive definite\n";
  const char* verdict = c.nees_mean > 4.5   ? "overconfident"
                        : c.nees_mean < 2.0 ? "conservative"
                                            : "consistent";
  return fmt::format(
      "consistency: NEES {:.2f} on average ({} expected: 3), {:.1f} % within 95 % ellipsoids: {}{}\n",
      c.nees_mean, "x, y, yaw;", 100 * c.inside_95, verdict,
      c.refused > 0 ? fmt::format("; {} invalid covariances", c.refused) : "");
}

std::string nis_text(const NisSummary& nis) {
  const char* verdict =
      nis.mean > 1.5 ? "innovations are larger than assumed: calibrate, or assume more noise"
      : nis.mean < 0.5
          ? "innovations are smaller than assumed: assume less noise"
          : "consistent (errors common to all observations, such as a displaced map, are not tested)";
  return fmt::format(
      "observations: NIS {:.2f} per degree of freedom over {} (expected: 1), {} rejected: {}\n", nis.mean,
      nis.observations, nis.rejected, verdict);
}

}  // namespace

std::string to_text(const TrajectoryReport& report) {
  std::string text = fmt::format("{:<20}{:>7}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "", "poses",
                                 "ATE m", "max m", "yaw deg", "RPE m", "path m", "max m", "side m");
  for (const TrajectoryRow& row : report.rows) text += row_text(row);
  const TrajectoryRow& estimate = report.rows.front();
  if (estimate.scores)
    text += fmt::format("ATE, yaw, path, side: root mean square; alignment {}{}; RPE over {}\n",
                        to_string(report.alignment),
                        report.alignment == AlignmentKind::Sim3
                            ? fmt::format(", scale {:.5f}", estimate.scores->alignment.scale)
                            : "",
                        report.options.rpe_delta_m > 0 ? fmt::format("{} m", report.options.rpe_delta_m)
                                                       : fmt::format("{} s", report.options.rpe_delta_s));
  if (estimate.scores && estimate.scores->consistency)
    text += consistency_text(*estimate.scores->consistency);
  if (report.nis) text += nis_text(*report.nis);
  if (report.uncertain > 0)
    text += fmt::format("not evaluated: {} estimates marked uncertain\n", report.uncertain);
  if (estimate.jumps) text += fmt::format("jumps: {}\n", *estimate.jumps);
  if (report.coverage) text += fmt::format("coverage: {:.1f} % of the time\n", 100 * *report.coverage);
  if (report.time_to_first_fix_s)
    text += fmt::format("first fix: after {:.2f} s\n", *report.time_to_first_fix_s);
  text += fmt::format("end: {:.3f} m and {:.1f} deg from the start\n", end_to_start_m(estimate.poses),
                      end_to_start_deg(estimate.poses));
  return text;
}

}  // namespace waymark
