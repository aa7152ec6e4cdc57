#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/field_refusals.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/common/trajectory_files.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/evaluation/trajectory_scores.hpp"
#include "waymark/samples/tag_map.hpp"

/// `waymark evaluate`: compares a trajectory with ground truth.
namespace waymark {

struct EvaluateTrajectoryJob {
  std::string estimate{};   ///< recording with poses, or a TUM file
  std::string reference{};  ///< see read_reference()
  std::string estimate_topic{};
  std::string reference_topic{};
  std::string odometry{};          ///< recording whose odometry is also evaluated; empty if there is none
  std::string figures{};           ///< folder for figures; if empty, none are written
  std::string map{};               ///< map whose tags are drawn; empty if there is none
  std::string alignment = "none";  ///< see alignment_kind()
  bool closed = false;             ///< whether the reference path returns to its first point
  double from_s = 0;               ///< relative to the start of the estimate, like to_s
  double to_s = 1e9;
  double time_offset_s = 0;  ///< added to the timestamps of the reference
  TrajectoryScoreOptions scoring{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.estimate,
          JobField("estimate EST", "Estimate to evaluate: a recording with poses, or a TUM file").input());
    visit(self.reference, JobField("reference REF",
                                   "Reference: a recording with /truth/pose, a TUM file, a route.yaml, "
                                   "or a CSV of points (x_m,y_m), which defines only a path")
                              .input());
    visit(self.estimate_topic, JobField("est_topic TOPIC", "Topic with EST's poses; usually /waymark/pose"));
    visit(self.reference_topic, JobField("ref_topic TOPIC", "Topic with REF's poses; usually /truth/pose"));
    visit(
        self.alignment,
        JobField(
            "alignment KIND",
            "Alignment before errors are computed: none (the map's own frame), se2, se3 or sim3 (with scale)")
            .one_of("none,se2,se3,sim3"));
    visit(self.closed, JobField("closed", "Treat the path of REF as closed: it returns to its first point"));
    visit(self.odometry, JobField("odometry LOG",
                                  "Recording whose wheel odometry is evaluated as well, with and without "
                                  "gyro, starting at the first pose of EST"));
    visit(self.from_s,
          JobField("from S", "Start of the evaluated interval, in seconds from the start of EST"));
    visit(self.to_s, JobField("to S", "End of the evaluated interval, in seconds from the start of EST")
                         .without_default());
    visit(self.time_offset_s,
          JobField("time_offset_s NUMBER", "Clock offset added to the stamps of REF").usually("0"));
    visit(self.figures,
          JobField("figures FOLDER", "Folder for figures: paths seen from above, and error over time"));
    visit(self.map, JobField("map FILE", "Map whose tags are drawn in the figure"));
  }
};

/// Evaluation of one trajectory.
struct TrajectoryRow {
  std::string name{};  ///< "estimate", "odometry" or "odometry with gyro"
  EstimatedTrajectory poses{};
  std::optional<TrajectoryScores> scores{};  ///< empty if the reference contains no times
  std::optional<PathScores> path{};
  std::size_t pairs = 0;               ///< number of poses at times covered by the reference
  std::optional<std::size_t> jumps{};  ///< relative to the reference or, without one, to the odometry
};

struct TrajectoryReport {
  std::string estimate{};   ///< path of the file
  std::string reference{};  ///< path of the file
  AlignmentKind alignment = AlignmentKind::None;
  TrajectoryScoreOptions options{};
  std::vector<TrajectoryRow> rows{};  ///< the estimate comes first
  std::optional<double> coverage{};
  std::optional<NisSummary> nis{};
  std::size_t uncertain = 0;  ///< number of uncertain estimates, which are not evaluated
  std::optional<double> time_to_first_fix_s{};
};

/// The contents of the files named in a job.
struct EvaluationInputs {
  EstimatedTrajectory estimate{};
  Reference reference{};
  Motion motion{};
  TagMap tags{};
};

[[nodiscard]] Result<EvaluationInputs> read_evaluation(const EvaluateTrajectoryJob& job,
                                                       const JobControl& control);
[[nodiscard]] Result<TrajectoryReport> evaluate_trajectory(const EvaluateTrajectoryJob& job,
                                                           const EvaluationInputs& inputs,
                                                           const JobControl& control);
/// Writes figures for the comparison to a folder, and returns their paths.
[[nodiscard]] Result<std::vector<std::string>> write_evaluation_figures(const EvaluationInputs& inputs,
                                                                        const TrajectoryReport& report,
                                                                        const std::string& folder);
/// Distance and heading change from the first pose to the last. These are the errors for a robot that has
/// returned to its start. Both are 0 without poses.
[[nodiscard]] double end_to_start_m(const EstimatedTrajectory& poses);
[[nodiscard]] double end_to_start_deg(const EstimatedTrajectory& poses);

/// Unknown values are null.
[[nodiscard]] ReportFields fields(const TrajectoryReport& report);

/// Fails on options that have no effect. `reference` is null if it has not been read yet.
[[nodiscard]] Status check_effects(const EvaluateTrajectoryJob& job, const Reference* reference,
                                   const GivenFields& given);

/// Warns if the trajectories have few times in common, if they are from different drives, or if the distance
/// between them is as large as the reference. Drives are considered different if both recordings contain
/// wheel odometry and it differs. If the two files are recordings, their odometry is read again.
[[nodiscard]] std::vector<std::string> comparison_warnings(const TrajectoryReport& report,
                                                           const Reference& reference,
                                                           const JobControl& control = {});

/// A table with one row per trajectory, followed by lines about consistency, jumps and coverage.
[[nodiscard]] std::string to_text(const TrajectoryReport& report);

}  // namespace waymark
