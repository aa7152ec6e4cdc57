// Trajectories compared with a reference: intervals, clock offsets, alignments, odometry, unknown values, and
// warnings about questionable comparisons.
#include "waymark/app/evaluate/evaluate_trajectory.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/trajectory_files.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// The pose on an ellipse at the given time.
SE3 on_ellipse(double s) {
  const double angle = 0.2 * s;
  return lift(SE2(3 * std::cos(angle), 2 * std::sin(angle), angle));
}

Trajectory ellipse(double from_s, double to_s, const SE3& moved = {}, double offset_s = 0) {
  Trajectory path;
  for (int i = static_cast<int>(10 * from_s); i <= static_cast<int>(10 * to_s); ++i)
    path.push_back(
        {SensorTime(Duration(std::llround((0.1 * i + offset_s) * 1e9))), moved * on_ellipse(0.1 * i)});
  return path;
}

class EvaluateTrajectoryFiles : public ::testing::Test {
 protected:
  [[nodiscard]] std::string tum(const std::string& name, const Trajectory& path) const {
    EXPECT_TRUE(write_text_file(folder_ / name, to_tum(path)));
    return (folder_ / name).string();
  }
  static Result<TrajectoryReport> evaluated(const EvaluateTrajectoryJob& job,
                                            const JobControl& control = {}) {
    const auto inputs = read_evaluation(job, {});
    if (!inputs) return tl::unexpected(inputs.error());
    return evaluate_trajectory(job, *inputs, control);
  }
  fs::path folder_ = testing::fresh_folder("jobs_evaluate_trajectory");
  EvaluateTrajectoryJob job_{.estimate = tum("est.txt", ellipse(0, 30)),
                             .reference = tum("ref.txt", ellipse(0, 30))};
};

TEST_F(EvaluateTrajectoryFiles, EqualTrajectoriesHaveNoErrorAndUnknownValuesAreEmpty) {
  const auto report = evaluated(job_);
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_TRUE(report->rows.front().scores);
  EXPECT_NEAR(report->rows.front().scores->ate_m.max, 0, 1e-6);
  EXPECT_EQ(report->rows.front().pairs, 301U);
  EXPECT_EQ(report->rows.front().jumps, 0U);
  const auto json = to_json(fields(*report));
  EXPECT_EQ(json["poses"], 301);
  EXPECT_FALSE(report->nis) << "a TUM file contains no observations";
}

TEST_F(EvaluateTrajectoryFiles, OnlyAlignmentRemovesADifferenceOfFrames) {
  const SE3 moved = lift(SE2(5, -1, 0.8));
  job_.estimate = tum("moved.txt", ellipse(0, 30, moved));
  std::string notes;
  const JobControl control{.note = [&](const std::string& text) { notes += text; }};
  const auto plain = evaluated(job_, control);
  ASSERT_TRUE(plain);
  EXPECT_GT(plain->rows.front().scores->ate_m.rmse, 2);
  EXPECT_THAT(notes, HasSubstr("`alignment=se2` the ATE is 0.0000 m"));
  notes.clear();
  job_.alignment = "se2";
  const auto aligned = evaluated(job_, control);
  EXPECT_EQ(notes, "");
  ASSERT_TRUE(aligned) << to_string(aligned.error());
  EXPECT_LT(aligned->rows.front().scores->ate_m.rmse, 1e-6);
  EXPECT_EQ(aligned->alignment, AlignmentKind::Se2);
  job_.alignment = "se4";
  const auto unknown = evaluated(job_, control);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().place.key, "alignment");
}

TEST_F(EvaluateTrajectoryFiles, AClockOffsetIsSubtracted) {
  job_.reference = tum("late.txt", ellipse(0, 30, {}, 0.5));
  const double apart_m = evaluated(job_)->rows.front().scores->ate_m.rmse;
  EXPECT_GT(apart_m, 0.1);
  job_.time_offset_s = -0.5;
  EXPECT_LT(evaluated(job_)->rows.front().scores->ate_m.rmse, 0.01);
}

TEST_F(EvaluateTrajectoryFiles, OnlyTheRequestedIntervalIsEvaluated) {
  Trajectory path = ellipse(0, 30);
  for (StampedPose& pose : path)
    if (pose.stamp > SensorTime(std::chrono::seconds(20)))
      pose.map_T_base = SE3(SO3(), {0, 0.4, 0}) * pose.map_T_base;
  job_.estimate = tum("jump.txt", path);
  const auto whole = evaluated(job_);
  ASSERT_TRUE(whole);
  EXPECT_NEAR(whole->rows.front().scores->ate_m.max, 0.4, 1e-6);
  EXPECT_EQ(whole->rows.front().jumps, 1U);
  job_.to_s = 19;
  const auto before = evaluated(job_);
  ASSERT_TRUE(before);
  EXPECT_NEAR(before->rows.front().scores->ate_m.max, 0, 1e-6);
  job_.from_s = 21;
  job_.to_s = 1e9;
  const auto after = evaluated(job_);
  ASSERT_TRUE(after);
  EXPECT_NEAR(after->rows.front().scores->ate_m.rmse, 0.4, 1e-6);
  job_.from_s = 500;
  EXPECT_FALSE(evaluated(job_)) << "the interval contains no estimate";
}

TEST_F(EvaluateTrajectoryFiles, AReferenceWithoutTimesHasOnlyDistances) {
  std::string corners = "x_m,y_m\n";
  for (const StampedPose& pose : ellipse(0, 32)) {
    const Eigen::Vector3d p = pose.map_T_base.translation();
    corners += fmt::format("{},{}\n", p.x(), p.y());
  }
  ASSERT_TRUE(write_text_file(folder_ / "path.csv", corners));
  job_.reference = (folder_ / "path.csv").string();
  job_.estimate = tum("beside.txt", ellipse(0, 30, SE3(SO3(), {0, 0.1, 0})));
  const auto report = evaluated(job_);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_FALSE(report->rows.front().scores);
  ASSERT_TRUE(report->rows.front().path);
  EXPECT_GT(report->rows.front().path->distance_m.rmse, 0.04);
  EXPECT_LE(report->rows.front().path->distance_m.max, 0.1 + 1e-6);
}

TEST_F(EvaluateTrajectoryFiles, OdometryIsComparedWithTheEstimate) {
  const std::string lap = test::record_lap(folder_ / "lap.mcap", 81, {.for_s = 8});
  const EvaluateTrajectoryJob job{
      .estimate = lap, .reference = lap, .estimate_topic = topics::kTruth, .odometry = lap};
  const auto report = evaluated(job);
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_GE(report->rows.size(), 2U);
  EXPECT_EQ(report->rows[0].name, "estimate");
  EXPECT_EQ(report->rows[1].name, "odometry");
  ASSERT_TRUE(report->rows[1].scores);
  EXPECT_GT(report->rows[1].scores->ate_m.rmse, 0) << "wheel odometry drifts";
  const auto json = to_json(fields(*report));
  EXPECT_TRUE(json.dump().find("odometry") != std::string::npos);
  EvaluateTrajectoryJob none = job;
  none.odometry = tum("no_odometry.txt", ellipse(0, 1));
  EXPECT_FALSE(evaluated(none));
}

TEST_F(EvaluateTrajectoryFiles, AnImageMayPrecedeTheFirstOdometry) {
  const std::string lap = test::record_lap(folder_ / "lap.mcap", 81, {.for_s = 8});
  EvaluateTrajectoryJob job{
      .estimate = lap, .reference = lap, .estimate_topic = topics::kTruth, .odometry = lap};
  const auto inputs = read_evaluation(job, {});
  ASSERT_TRUE(inputs) << to_string(inputs.error());
  const Trajectory truth = inputs->reference.timed;
  const auto with_pose_before = [&](Duration before) {
    Trajectory path = truth;
    path.insert(path.begin(), {truth.front().stamp - before, truth.front().map_T_base});
    job.estimate = tum(fmt::format("before_{}.txt", before.count()), path);
    job.estimate_topic.clear();
    return evaluated(job);
  };
  const auto report = with_pose_before(std::chrono::milliseconds(60));
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_GE(report->rows.size(), 2U);
  EXPECT_EQ(report->rows[1].name, "odometry");
  const auto apart = with_pose_before(std::chrono::seconds(100));
  ASSERT_FALSE(apart) << "the clocks differ";
  EXPECT_THAT(apart.error().message, HasSubstr("does not cover"));
}

TEST_F(EvaluateTrajectoryFiles, EndToStartIsTheMotionFromTheFirstPoseToTheLast) {
  EstimatedTrajectory poses;
  EXPECT_EQ(end_to_start_m(poses), 0);
  for (const double x : {0.0, 5.0, 0.3})
    poses.push_back({SensorTime(), lift(SE2(x, 0.4 * (x == 0.3), 0.1 * x)), {}});
  EXPECT_NEAR(end_to_start_m(poses), 0.5, 1e-12);
  EXPECT_NEAR(end_to_start_deg(poses), 0.03 * 180 / M_PI, 1e-9);
}

TEST_F(EvaluateTrajectoryFiles, TheFolderOfFiguresIsCreated) {
  const auto inputs = read_evaluation(job_, {});
  ASSERT_TRUE(inputs);
  const auto report = evaluate_trajectory(job_, *inputs, {});
  ASSERT_TRUE(report);
  const auto files = write_evaluation_figures(*inputs, *report, (folder_ / "deep" / "figures").string());
  ASSERT_TRUE(files) << to_string(files.error());
  EXPECT_FALSE(files->empty());
  for (const std::string& file : *files) EXPECT_TRUE(fs::exists(file)) << file;
  const auto blocked = write_evaluation_figures(*inputs, *report, job_.estimate);
  ASSERT_FALSE(blocked) << "a file is not a folder";
  EXPECT_EQ(blocked.error().code, ErrorCode::Unwritable);
}

/// A circle with a radius of 2 m around (`x_m`, 0), with ten poses per second.
Trajectory circle(double from_s, double to_s, double x_m = 0) {
  Trajectory path;
  for (int i = static_cast<int>(10 * from_s); i <= static_cast<int>(10 * to_s); ++i)
    path.push_back({SensorTime(Duration(i * 100'000'000LL)),
                    lift(SE2(x_m + 2 * std::cos(0.02 * i), 2 * std::sin(0.02 * i), 0.02 * i))});
  return path;
}

class ComparisonWarnings : public ::testing::Test {
 protected:
  [[nodiscard]] std::string tum(const std::string& name, const Trajectory& path) const {
    EXPECT_TRUE(write_text_file(folder_ / name, to_tum(path)));
    return (folder_ / name).string();
  }
  static std::vector<std::string> warnings(const EvaluateTrajectoryJob& job) {
    const auto inputs = read_evaluation(job, {});
    EXPECT_TRUE(inputs) << to_string(inputs.error());
    const auto report = evaluate_trajectory(job, *inputs, {});
    EXPECT_TRUE(report) << to_string(report.error());
    return comparison_warnings(*report, inputs->reference);
  }
  fs::path folder_ = testing::fresh_folder("jobs_comparison_warnings");
};

TEST_F(ComparisonWarnings, APlausibleErrorIsNoWarning) {
  EXPECT_THAT(warnings({.estimate = tum("a.txt", circle(0, 30)), .reference = tum("b.txt", circle(0, 30))}),
              IsEmpty());
  EXPECT_THAT(
      warnings({.estimate = tum("a.txt", circle(0, 30, 0.25)), .reference = tum("b.txt", circle(0, 30))}),
      IsEmpty())
      << "0.25 m is an error, not a different place";
}

TEST_F(ComparisonWarnings, FewCommonTimes) {
  const std::string reference = tum("b.txt", circle(0, 30));
  EXPECT_THAT(warnings({.estimate = tum("a.txt", circle(20, 60)), .reference = reference}),
              ElementsAre(HasSubstr("only 101 of 401 poses of EST")));
  EXPECT_THAT(warnings({.estimate = tum("a.txt", circle(10, 40)), .reference = reference}), IsEmpty())
      << "two thirds of the times overlap";
}

TEST_F(ComparisonWarnings, ADistantPlaceUnlessAligned) {
  EvaluateTrajectoryJob job{.estimate = tum("a.txt", circle(0, 30, 5)),
                            .reference = tum("b.txt", circle(0, 30))};
  EXPECT_THAT(warnings(job), ElementsAre(HasSubstr("EST is 5.0 m from REF")));
  job.alignment = "se2";
  EXPECT_THAT(warnings(job), IsEmpty());
}

TEST_F(ComparisonWarnings, OdometryRevealsDifferentDrives) {
  const auto lap = [&](const char* name, std::uint64_t seed) {
    return test::record_lap(folder_ / name, seed, {.for_s = 8});
  };
  EvaluateTrajectoryJob job{.estimate = lap("a.mcap", 1),
                            .reference = lap("b.mcap", 2),
                            .estimate_topic = topics::kTruth,
                            .reference_topic = topics::kTruth};
  EXPECT_THAT(warnings(job), Contains(HasSubstr("different drives")));
  job.reference = lap("c.mcap", 1);
  EXPECT_THAT(warnings(job), IsEmpty()) << "the same seed gives the same lap";
}

/// Ten seconds from a recorded lap.
struct TenSeconds {
  fs::path folder = testing::fresh_folder("jobs_evaluate_lap");
  std::string lap = test::record_lap(folder / "lap.mcap", 8, {.for_s = 10});
};

const TenSeconds& ten_seconds() {
  static const TenSeconds made;
  return made;
}

TEST(EvaluateTrajectory, AnIntervalWithoutEstimatesIsAnError) {
  EvaluateTrajectoryJob job{.estimate = ten_seconds().lap,
                            .reference = ten_seconds().lap,
                            .estimate_topic = topics::kTruth,
                            .from_s = 1000};
  const auto inputs = read_evaluation(job, {});
  ASSERT_TRUE(inputs) << to_string(inputs.error());
  const auto late = evaluate_trajectory(job, *inputs, {});
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, ErrorCode::NotFound);
  job.from_s = 0;
  const auto same = evaluate_trajectory(job, *inputs, {});
  ASSERT_TRUE(same) << to_string(same.error());
  EXPECT_EQ(same->rows.front().scores->ate_m.max, 0);
  job.estimate_topic = "/odomm";
  const auto unknown = read_evaluation(job, {});
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::NotFound);
}

TEST(EvaluateTrajectory, AShiftOfTheEstimateIsTheError) {
  const EvaluateTrajectoryJob job{
      .estimate = ten_seconds().lap, .reference = ten_seconds().lap, .estimate_topic = topics::kTruth};
  auto inputs = read_evaluation(job, {});
  ASSERT_TRUE(inputs);
  for (EstimatedPose& pose : inputs->estimate)
    pose.map_T_base =
        SE3(pose.map_T_base.rotation(), pose.map_T_base.translation() + Eigen::Vector3d(0.3, 0.4, 0));
  const auto report = evaluate_trajectory(job, *inputs, {});
  ASSERT_TRUE(report);
  EXPECT_NEAR(report->rows.front().scores->ate_m.rmse, 0.5, 1e-9);
  const auto files = write_evaluation_figures(*inputs, *report, (ten_seconds().folder / "figures").string());
  ASSERT_TRUE(files) << to_string(files.error());
  for (const std::string& file : *files) EXPECT_TRUE(fs::exists(file)) << file;
}

TEST(TrajectoryText, PrintsOneRowPerTrajectoryAndAVerdict) {
  TrajectoryReport report;
  TrajectoryRow row{.name = "estimate"};
  row.poses = {{.stamp = SensorTime{}},
               {.stamp = SensorTime(std::chrono::milliseconds(100)), .map_T_base = SE3({}, {0.3, 0.4, 0})}};
  report.rows = {row, {.name = "odometry"}};
  std::string text = to_text(report);
  EXPECT_THAT(text, AllOf(HasSubstr("estimate "), HasSubstr("odometry "), HasSubstr("0.500 m and 0.0 deg")));
  EXPECT_THAT(text, Not(HasSubstr("alignment"))) << "nothing is aligned without a reference";
  TrajectoryScores scores;
  scores.ate_m.rmse = 0.0123;
  scores.consistency = Consistency{.count = 100, .nees_mean = 9, .inside_95 = 0.5};
  report.rows[0].scores = scores;
  report.nis = NisSummary{.mean = 0.3, .observations = 50, .rejected = 2};
  report.uncertain = 3;
  report.coverage = 0.75;
  report.time_to_first_fix_s = 2;
  text = to_text(report);
  EXPECT_THAT(text, AllOf(HasSubstr("0.0123"), HasSubstr("NEES 9.00 on average"), HasSubstr("overconfident"),
                          HasSubstr("assume less noise"), HasSubstr(": 3 estimates"), HasSubstr("75.0 %"),
                          HasSubstr("after 2.00 s")));
  report.rows[0].scores->consistency->nees_mean = 1.5;
  EXPECT_THAT(to_text(report), HasSubstr("conservative"));
  report.rows[0].scores->consistency->nees_mean = 3;
  EXPECT_THAT(to_text(report), HasSubstr(": consistent"));
  report.rows[0].scores->consistency->count = 0;
  EXPECT_THAT(to_text(report), HasSubstr("no covariance of the estimate is positive definite"));
}

/// A report on an estimate with the given error. The reference covers `pairs` of its `poses`.
TrajectoryReport report_of(double rmse_m, std::size_t pairs, std::size_t poses) {
  TrajectoryReport report{.estimate = "/none/a", .reference = "/none/b"};
  TrajectoryRow row{
      .name = "estimate", .poses = EstimatedTrajectory(poses), .scores = TrajectoryScores{}, .pairs = pairs};
  row.scores->ate_m.rmse = rmse_m;
  report.rows.push_back(row);
  return report;
}

Reference square_reference(double side_m) {
  Reference reference;
  reference.path.corners = {{0, 0}, {side_m, 0}, {side_m, side_m}, {0, side_m}};
  return reference;
}

TEST(WarningsOfReport, ASmallErrorIsNoWarning) {
  EXPECT_THAT(comparison_warnings(report_of(0.1, 90, 100), square_reference(4)), IsEmpty());
}

TEST(WarningsOfReport, FewCommonTimes) {
  const auto warnings = comparison_warnings(report_of(0.1, 40, 100), square_reference(4));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_THAT(warnings[0], HasSubstr("only 40 of 100"));
}

TEST(WarningsOfReport, ADistanceAsLargeAsTheReference) {
  const auto warnings = comparison_warnings(report_of(5, 90, 100), square_reference(4));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_THAT(warnings[0], HasSubstr("`alignment=se2`"));
  TrajectoryReport aligned = report_of(5, 90, 100);
  aligned.alignment = AlignmentKind::Se2;
  EXPECT_THAT(comparison_warnings(aligned, square_reference(4)), IsEmpty()) << "only shapes are compared";
  EXPECT_THAT(comparison_warnings(report_of(0.2, 90, 100), square_reference(0.1)), IsEmpty())
      << "the robot hardly moved";
}

TEST(WarningsOfReport, OdometryRevealsDifferentDrives) {
  const fs::path folder = testing::fresh_folder("jobs_two_drives");
  TrajectoryReport report = report_of(0.1, 90, 100);
  report.estimate = test::record_lap(folder / "a.mcap", 31, {.for_s = 3});
  report.reference = test::record_lap(folder / "b.mcap", 32, {.for_s = 3});
  const auto warnings = comparison_warnings(report, square_reference(4));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_THAT(warnings[0], HasSubstr("different drives"));
  report.reference = report.estimate;
  EXPECT_THAT(comparison_warnings(report, square_reference(4)), IsEmpty());
}

TEST(WarningsOfReport, OdometryInTransformsRevealsDifferentDrives) {
  const fs::path folder = testing::fresh_folder("jobs_two_drives_transforms");
  const auto lap = [&](const char* name, std::uint64_t seed) {
    return test::record_lap(folder / name, seed, {.for_s = 3, .odometry_in_transforms = true});
  };
  TrajectoryReport report = report_of(0.1, 90, 100);
  report.estimate = lap("a.mcap", 31);
  report.reference = lap("b.mcap", 32);
  EXPECT_THAT(comparison_warnings(report, square_reference(4)), ElementsAre(HasSubstr("different drives")));
  report.reference = lap("c.mcap", 31);
  EXPECT_THAT(comparison_warnings(report, square_reference(4)), IsEmpty());
}

}  // namespace
}  // namespace waymark
