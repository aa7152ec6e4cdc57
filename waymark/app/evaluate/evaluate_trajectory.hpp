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

/// `waymark evaluate`: compares a trajectory with the true one.
namespace waymark {

struct EvaluateTrajectoryJob {
  std::string estimate{};   ///< estimate: a recording with poses, or a TUM file
  std::string reference{};  ///< reference: see read_reference()
  std::string estimate_topic{};
  std::string reference_topic{};
  std::string odometry{};          ///< recording whose odometry is evaluated as well; empty: none
  std::string figures{};           ///< folder to draw into; empty: none
  std::string map{};               ///< whose tags the figure shows; empty: none
  std::string alignment = "none";  ///< an alignment_kind()
  bool closed = false;             ///< the corners of the reference go back to the first one
  double from_s = 0;               ///< after the start of the estimate
  double to_s = 1e9;
  double time_offset_s = 0;  ///< added to the stamps of the reference
  TrajectoryScoreOptions scoring{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.estimate,
          JobField("estimate EST", "Estimate to evaluate: a recording with poses, or a TUM file").input());
    visit(self.reference, JobField("reference REF",
                                   "Reference: a recording with /truth/pose, a TUM file, a route.yaml, "
                                   "or a CSV of points (x_m,y_m), which defines only a path")
                              .input());
    visit(self.estimate_topic, JobField("est_topic TOPIC", "Topic of EST's poses; usually /waymark/pose"));
    visit(self.reference_topic, JobField("ref_topic TOPIC", "Topic of REF's poses; usually /truth/pose"));
    visit(
        self.alignment,
        JobField(
            "alignment KIND",
            "Alignment before errors are computed: none (the map's own frame), se2, se3 or sim3 (with scale)")
            .one_of("none,se2,se3,sim3"));
    visit(self.closed, JobField("closed", "Close the loop: the points of REF return to the first one"));
    visit(self.odometry, JobField("odometry LOG",
                                  "Evaluate the wheel odometry, and wheels with gyro, of this recording "
                                  "beside EST, started at the same pose"));
    visit(self.from_s,
          JobField("from S", "Start of the evaluated interval, in seconds from the start of EST"));
    visit(self.to_s, JobField("to S", "End of the evaluated interval, in seconds from the start of EST")
                         .without_default());
    visit(self.time_offset_s,
          JobField("time_offset_s NUMBER", "Clock offset added to the stamps of REF").usually("0"));
    visit(self.figures, JobField("figures FOLDER", "Folder for figures: paths from above, error over time"));
    visit(self.map, JobField("map FILE", "Map whose tags are drawn in the figure"));
  }
};

/// Evaluation of one trajectory.
struct TrajectoryRow {
  std::string name{};  ///< "estimate", "odometry", "odometry with gyro"
  EstimatedTrajectory poses{};
  std::optional<TrajectoryScores> scores{};  ///< nothing without a reference that has times
  std::optional<PathScores> path{};
  std::size_t pairs = 0;               ///< poses at times covered by the reference
  std::optional<std::size_t> jumps{};  ///< against the reference, else against odometry
};

struct TrajectoryReport {
  std::string estimate{};   ///< file
  std::string reference{};  ///< file
  AlignmentKind alignment = AlignmentKind::None;
  TrajectoryScoreOptions options{};
  std::vector<TrajectoryRow> rows{};  ///< the estimate first
  std::optional<double> coverage{};
  std::optional<NisSummary> nis{};
  std::size_t uncertain = 0;  ///< uncertain estimates, which are not evaluated
  std::optional<double> time_to_first_fix_s{};
};

/// All inputs.
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
/// Writes figures of the comparison into a folder; returns the files.
[[nodiscard]] Result<std::vector<std::string>> write_evaluation_figures(const EvaluationInputs& inputs,
                                                                        const TrajectoryReport& report,
                                                                        const std::string& folder);
/// From the first pose to the last, for a robot that returned to its start; 0 without poses.
[[nodiscard]] double end_to_start_m(const EstimatedTrajectory& poses);
[[nodiscard]] double end_to_start_deg(const EstimatedTrajectory& poses);

/// Unknown values are null.
[[nodiscard]] ReportFields fields(const TrajectoryReport& report);

/// Fails on options without effect on the comparison; `reference`: once it is read.
[[nodiscard]] Status check_effects(const EvaluateTrajectoryJob& job, const Reference* reference,
                                   const GivenFields& given);

/// Warnings about a comparison: few common times, two drives (both recordings contain
/// wheel odometry, which differs), two places. Empty without warnings. Reads the odometry
/// of both files again if they are recordings.
[[nodiscard]] std::vector<std::string> doubts_about(const TrajectoryReport& report,
                                                    const Reference& reference,
                                                    const JobControl& control = {});

/// A table with one row per trajectory, then text about consistency, jumps and coverage.
[[nodiscard]] std::string to_text(const TrajectoryReport& report);

}  // namespace waymark
