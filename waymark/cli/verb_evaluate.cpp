#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <nlohmann/json.hpp>

#include "waymark/base/suggest.hpp"
#include "waymark/cli/detections_json.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/trajectory_doubts.hpp"
#include "waymark/cli/trajectory_files.hpp"
#include "waymark/cli/trajectory_report.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/evaluation/dead_reckoning.hpp"
#include "waymark/jobs/figure_files.hpp"
#include "waymark/plot/loop_figures.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;
using namespace std::string_literals;

struct TrajectoryArgs {
  explicit TrajectoryArgs(CLI::App& app) : scoring(app, "Scoring") {}

  std::string estimate;
  std::string reference;
  std::string est_topic;
  std::string ref_topic;
  std::string alignment = "none";
  bool closed = false;
  std::string odometry;
  double from_s = 0;
  double to_s = 1e9;
  double time_offset_s = 0;
  std::string figures;
  std::string map;
  bool json = false;
  OptionFlags<TrajectoryScoreOptions> scoring;
};

/// Everything that was read.
struct Inputs {
  EstimatedTrajectory estimate{};
  Reference reference{};
  Motion motion{};
  TagMap tags{};
};

Duration duration_of(double seconds) { return Duration(static_cast<std::int64_t>(seconds * 1e9)); }

Result<Inputs> read_inputs(const TrajectoryArgs& args) {
  Inputs inputs;
  Result<EstimatedTrajectory> estimate = read_estimate(args.estimate, args.est_topic);
  if (!estimate) return tl::unexpected(estimate.error());
  inputs.estimate = std::move(*estimate);
  Result<Reference> reference = read_reference(args.reference, args.ref_topic, args.closed);
  if (!reference) return tl::unexpected(reference.error());
  inputs.reference = std::move(*reference);
  for (StampedPose& pose : inputs.reference.timed) pose.stamp += duration_of(args.time_offset_s);
  if (!args.odometry.empty()) {
    Result<Motion> motion = read_motion(args.odometry);
    if (!motion) return tl::unexpected(motion.error());
    inputs.motion = std::move(*motion);
  }
  if (!args.map.empty()) {
    const Result<MapFile> map = read_map(args.map);
    if (!map) return tl::unexpected(map.error());
    inputs.tags = map->tags;
  }
  return inputs;
}

EstimatedTrajectory within(const EstimatedTrajectory& poses, SensorTime from, SensorTime to) {
  EstimatedTrajectory kept;
  for (const EstimatedPose& pose : poses)
    if (pose.stamp >= from && pose.stamp <= to) kept.push_back(pose);
  return kept;
}

Result<TrajectoryRow> score_row(const std::string& name, EstimatedTrajectory poses, const Inputs& inputs,
                                const TrajectoryReport& report) {
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

/// When something was there to be known: the reference, else the odometry.
std::optional<std::pair<SensorTime, SensorTime>> knowable(const Inputs& inputs) {
  if (!inputs.reference.timed.empty())
    return std::pair(inputs.reference.timed.front().stamp, inputs.reference.timed.back().stamp);
  if (!inputs.motion.odometry.empty())
    return std::pair(inputs.motion.odometry.front().stamp, inputs.motion.odometry.back().stamp);
  return std::nullopt;
}

/// The rows of dead reckoning, from where the estimate begins to where it ends.
Status add_dead_reckoning(const Inputs& inputs, TrajectoryReport& report) {
  const EstimatedTrajectory estimate = report.rows.front().poses;
  const StampedPose start{estimate.front().stamp, estimate.front().map_T_base};
  const Trajectory wheels = wheel_odometry(inputs.motion.odometry);
  const Trajectory gyro = gyro_odometry(inputs.motion.odometry, inputs.motion.imu);
  if (!report.rows.front().jumps && !wheels.empty())
    report.rows.front().jumps =
        count_jumps(pair_by_time(estimate, wheels, duration_of(report.options.max_gap_s)), report.options);
  if (!wheels.empty() && !pose_at(wheels, start.stamp, Duration::max()))
    return fail(ErrorCode::InvalidArgument, "the odometry knows nothing of the time when EST begins",
                {.key = "--odometry"}, "Give a recording of the same drive, on the same clock.");
  for (const auto& [name, trajectory] :
       {std::pair("odometry", &wheels), std::pair("odometry with gyro", &gyro)}) {
    EstimatedTrajectory placed = within(placed_at(*trajectory, start), start.stamp, estimate.back().stamp);
    if (placed.empty()) continue;
    Result<TrajectoryRow> row = score_row(name, std::move(placed), inputs, report);
    if (!row) return tl::unexpected(row.error());
    report.rows.push_back(std::move(*row));
  }
  return {};
}

Result<TrajectoryReport> score(const TrajectoryArgs& args, const Inputs& inputs) {
  TrajectoryReport report{.estimate = args.estimate, .reference = args.reference};
  if (const Status usable = args.scoring.apply(report.options); !usable)
    return tl::unexpected(usable.error());
  report.alignment = *alignment_kind(args.alignment);
  const SensorTime begin = inputs.estimate.front().stamp;
  EstimatedTrajectory chosen =
      within(inputs.estimate, begin + duration_of(args.from_s), begin + duration_of(args.to_s));
  if (chosen.empty())
    return fail(ErrorCode::NotFound, "no estimate between --from and --to", {.source = args.estimate},
                fmt::format("It lasts {:.1f} s.", to_seconds(inputs.estimate.back().stamp - begin)));
  if (const auto when = knowable(inputs)) {
    const SensorTime from = std::max(when->first, args.from_s > 0 ? chosen.front().stamp : when->first);
    const SensorTime to = std::min(when->second, begin + duration_of(args.to_s));
    report.coverage = covered_share(chosen, from, to, duration_of(report.options.max_gap_s));
    report.time_to_first_fix_s = to_seconds(begin - when->first);
  }
  report.nis = read_nis(args.estimate, chosen.front().stamp, chosen.back().stamp);
  report.uncertain =
      count_uncertain(args.estimate, args.from_s > 0 ? chosen.front().stamp : SensorTime::min(),
                      begin + duration_of(args.to_s));
  Result<TrajectoryRow> row = score_row("estimate", std::move(chosen), inputs, report);
  if (!row) return tl::unexpected(row.error());
  report.rows.push_back(std::move(*row));
  if (const Status added = add_dead_reckoning(inputs, report); !added) return tl::unexpected(added.error());
  return report;
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

Status write_figures(const TrajectoryArgs& args, const Inputs& inputs, const TrajectoryReport& report,
                     std::vector<std::string>& files) {
  constexpr plot::Color kOdometryColor = plot::kTaughtColor;
  std::error_code failed;
  fs::create_directories(args.figures, failed);
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
  const fs::path folder = args.figures;
  if (Status status = write_figure(folder / "trajectories", plot::path_figure("Seen from above", layers),
                                   {".svg", ".png"}, files);
      !status)
    return status;
  if (inputs.reference.timed.empty()) return {};
  const plot::Figure errors = plot::trajectory_error_figure("Distance of the estimate from the truth",
                                                            layers.back().path, inputs.reference.timed);
  return write_figure(folder / "position_error", errors, {".svg", ".png"}, files);
}

ExitCode evaluate(const TrajectoryArgs& args, Console& console) {
  if (args.estimate.empty() || args.reference.empty()) {
    console.say("give two files, EST REF, or the verb 'detections'. " +
                (nearest_word(args.estimate, {"detections"}).empty() ? "" : "Did you mean 'detections'? "s) +
                "See `waymark evaluate --help`.");
    return ExitCode::Usage;
  }
  const Result<Inputs> inputs = read_inputs(args);
  if (!inputs) {
    console.say(inputs.error());
    return ExitCode::SomeFailed;
  }
  const Result<TrajectoryReport> report = score(args, *inputs);
  if (!report) {
    console.say(report.error());
    return ExitCode::SomeFailed;
  }
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report));
  for (const std::string& doubt : doubts_about(*report, inputs->reference)) console.say("warning: " + doubt);
  if (args.figures.empty()) return ExitCode::Ok;
  std::vector<std::string> files;
  if (const Status written = write_figures(args, *inputs, *report, files); !written) {
    console.say(written.error());
    return ExitCode::SomeFailed;
  }
  for (const std::string& file : files) console.say("wrote " + file);
  return ExitCode::Ok;
}

Run prepare_trajectory(CLI::App& app) {
  const auto args = std::make_shared<TrajectoryArgs>(app);
  app.add_option("EST", args->estimate, "What is judged: a recording with poses, or a TUM file")
      ->type_name("");
  app.add_option("REF", args->reference,
                 "What is right: a recording with /truth/pose, a TUM file, a route.yaml, or a CSV of corners "
                 "(x_m,y_m), of which only the path is known")
      ->type_name("");
  app.add_option("--est-topic", args->est_topic, "Topic of EST's poses; usually /waymark/pose")
      ->type_name("TOPIC");
  app.add_option("--ref-topic", args->ref_topic, "Topic of REF's poses; usually /truth/pose")
      ->type_name("TOPIC");
  app.add_option("--alignment", args->alignment,
                 "What may be moved before errors are measured: none (the map's own frame), se2, se3, sim3 "
                 "(with scale)")
      ->check(CLI::IsMember({"none", "se2", "se3", "sim3"}))
      ->capture_default_str()
      ->type_name("KIND");
  app.add_flag("--closed", args->closed, "The corners of REF go back to the first one");
  app.add_option("--odometry", args->odometry,
                 "Judge the wheel odometry, and wheels with gyro, of this recording beside it, started where "
                 "EST starts")
      ->type_name("LOG");
  app.add_option("--from", args->from_s, "Leave out what is earlier, in seconds from the start of EST")
      ->type_name("S");
  app.add_option("--to", args->to_s, "Leave out what is later, in seconds from the start of EST")
      ->type_name("S");
  app.add_option("--time-offset-s", args->time_offset_s, "Added to the stamps of REF, when its clock differs")
      ->capture_default_str()
      ->type_name("NUMBER");
  app.add_option("--figures", args->figures, "Folder for figures: paths from above, error along the way")
      ->type_name("FOLDER");
  app.add_option("--map", args->map, "Map whose tags the figure shows")->type_name("FILE");
  app.add_flag("--json", args->json, "One JSON object instead of a table");
  return [args](Console& console) { return evaluate(*args, console); };
}

}  // namespace

Verb evaluate_verb() {
  return {
      .name = "evaluate",
      .sentence = "Compare an answer with the truth",
      .help =
          R"(EST REF compares a trajectory with where the robot really was. Errors are measured at the same time (REF is
interpolated), in REF's frame: ATE is the distance, RPE the error of a motion of --rpe-delta-s seconds, as evo
defines them. path is the distance from REF's way whenever the robot was there; side the signed distance from the
side of REF that points as the robot does. NEES says whether the estimate's covariance is honest: 3 on average is,
more is too sure of itself; NIS (of the recordings of `waymark localize`) says the same of each sighting: 1. Estimates
that were called uncertain are counted, and not judged. Keys of --json: docs/reference/cli.md.

Exit code: 0 compared, 1 something could not be read or compared, 2 wrong usage.

Examples:
  waymark evaluate replay.mcap replay.mcap
  waymark evaluate map/trajectory.txt map/truth_trajectory.txt --figures figures
  waymark evaluate detections --truth truth.csv photograph.png
)",
      .prepare = prepare_trajectory,
      .verbs = {evaluate_detections_verb()}};
}

}  // namespace waymark::cli
