// Detections compared with ground truth: counts, corner errors, skipped images, and text output.
#include "waymark/app/evaluate/evaluate_detections.hpp"

#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// A square with a side of 40 px at (`x_px`, 100), shifted by `off_px` in x.
TagDetection square_at(int number, double x_px, double off_px = 0) {
  TagDetection detection{.tag = {FamilyId::Tag36h11, number}};
  detection.corners_px = {Eigen::Vector2d(x_px + off_px, 100),
                          {x_px + 40 + off_px, 100},
                          {x_px + 40 + off_px, 140},
                          {x_px + off_px, 140}};
  return detection;
}

std::string truth_row(const std::string& image, const TagDetection& tag) {
  std::string row = fmt::format("{},{}", image, tag.tag.number);
  for (const Eigen::Vector2d& corner : tag.corners_px) row += fmt::format(",{},{}", corner.x(), corner.y());
  return row + "\n";
}

class EvaluateDetections : public ::testing::Test {
 protected:
  Result<EvaluateDetectionsReport> evaluate(const std::vector<ImageReport>& reports,
                                            const std::string& truth) {
    std::string lines;
    for (const ImageReport& report : reports)
      lines += json_line(fields(ImageLine{.report = report, .with_covariance = true}));
    EXPECT_TRUE(write_text_file(folder_ / "detections.jsonl", lines));
    EXPECT_TRUE(write_text_file(folder_ / "truth.csv", "image,id,x0,y0,x1,y1,x2,y2,x3,y3\n" + truth));
    notes_.clear();
    JobControl control;
    control.note = [this](const std::string& text) { notes_.push_back(text); };
    return evaluate_detections(
        {.truth = (folder_ / "truth.csv").string(), .detections = (folder_ / "detections.jsonl").string()},
        TagFinder{}, control);
  }
  static ImageReport report_of(const std::string& name, std::vector<TagDetection> detections) {
    return {.image = name,
            .width_px = 640,
            .height_px = 480,
            .detected = true,
            .detections = std::move(detections)};
  }
  fs::path folder_ = testing::fresh_folder("jobs_evaluate_detections");
  std::vector<std::string> notes_{};
};

TEST_F(EvaluateDetections, CountsCorrectMissedWrongAndFalseDetections) {
  const auto report =
      evaluate({report_of("a.png", {square_at(1, 100), square_at(9, 300), square_at(5, 500)})},
               truth_row("a.png", square_at(1, 100)) + truth_row("a.png", square_at(2, 200)) +
                   truth_row("a.png", square_at(3, 300)));
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_TRUE(report->scores) << to_string(*report->error);
  const auto json = to_json(fields(*report->scores));
  EXPECT_EQ(json["truth"], 3);
  EXPECT_EQ(json["detections"], 3);
  EXPECT_EQ(json["correct"], 1);
  EXPECT_EQ(json["wrong_ids"], 1) << "tag 9 is reported where tag 3 is";
  EXPECT_EQ(json["false_positives"], 1) << "tag 5 is reported where there is no tag";
  EXPECT_NEAR(json["recall"].get<double>(), 1.0 / 3, 1e-12);
}

TEST_F(EvaluateDetections, AShiftOfAllCornersIsTheirBias) {
  const auto report =
      evaluate({report_of("a.png", {square_at(1, 100, 0.3)})}, truth_row("a.png", square_at(1, 100)));
  ASSERT_TRUE(report && report->scores);
  const auto corners = to_json(fields(*report->scores))["corners"];
  EXPECT_NEAR(corners["bias_x_px"].get<double>(), 0.3, 1e-6);
  EXPECT_NEAR(corners["bias_y_px"].get<double>(), 0, 1e-6);
  EXPECT_NEAR(corners["rmse_px"].get<double>(), 0.3, 1e-6);
  EXPECT_NEAR(corners["bias_outward_px"].get<double>(), 0, 1e-6);
}

TEST_F(EvaluateDetections, UnknownValuesAreNull) {
  const auto report = evaluate({report_of("a.png", {})}, truth_row("a.png", square_at(1, 100)));
  ASSERT_TRUE(report && report->scores);
  const auto json = to_json(fields(*report->scores));
  EXPECT_EQ(json["recall"], 0.0);
  EXPECT_TRUE(json["corners"].is_null());
  EXPECT_TRUE(json["consistency"].is_null()) << "there are no covariances";
}

TEST_F(EvaluateDetections, UnmatchedImagesAreReported) {
  const auto report =
      evaluate({report_of("a.png", {square_at(1, 100)}), report_of("b.png", {square_at(2, 100)})},
               truth_row("a.png", square_at(1, 100)) + truth_row("c.png", square_at(3, 100)));
  ASSERT_TRUE(report && report->scores);
  EXPECT_THAT(notes_, Contains(HasSubstr("no tag: 1 image")));
  EXPECT_THAT(notes_, Contains(HasSubstr("not given: 1 image")));
  EXPECT_EQ(report->scores->false_positives, 1U)
      << "an image without ground truth is assumed to contain no tag";
  EXPECT_EQ(report->scores->truth, 1U) << "tags in images that were not given are not counted";
  const auto others = evaluate({report_of("x.png", {})}, truth_row("a.png", square_at(1, 100)));
  ASSERT_TRUE(others);
  ASSERT_TRUE(others->error);
  EXPECT_THAT(others->error->hint, HasSubstr("a.png"));
}

TEST_F(EvaluateDetections, ImagesWithTheSameNameAreRejected) {
  const auto report =
      evaluate({report_of("x/a.png", {}), report_of("y/a.png", {})}, truth_row("a.png", square_at(1, 100)));
  ASSERT_TRUE(report);
  EXPECT_FALSE(report->scores);
  ASSERT_TRUE(report->error);
  EXPECT_THAT(report->error->hint, HasSubstr("folder"));
}

TEST_F(EvaluateDetections, FailedImagesAreSkippedAndCounted) {
  ImageReport failed = report_of("b.png", {});
  failed.detected = false;
  failed.error = Error{ErrorCode::Unreadable, "cut", {}, {}};
  const auto report = evaluate({report_of("a.png", {square_at(1, 100)}), failed},
                               truth_row("a.png", square_at(1, 100)) + truth_row("b.png", square_at(2, 100)));
  ASSERT_TRUE(report && report->scores);
  EXPECT_EQ(report->failed, 1U);
  EXPECT_EQ(report->scores->truth, 1U);
}

TEST_F(EvaluateDetections, UnreadableFilesAreReportedWithTheirPlace) {
  ASSERT_TRUE(evaluate({report_of("a.png", {})}, truth_row("a.png", square_at(1, 100))));
  const auto evaluate_again = [&] {
    return evaluate_detections(
        {.truth = (folder_ / "truth.csv").string(), .detections = (folder_ / "detections.jsonl").string()},
        TagFinder{}, {});
  };
  ASSERT_TRUE(write_text_file(folder_ / "detections.jsonl", "{\"image\": \"a.png\"}\n{broken\n"));
  const auto broken = evaluate_again();
  ASSERT_FALSE(broken);
  EXPECT_TRUE(broken.error().place.line);
  ASSERT_TRUE(write_text_file(folder_ / "truth.csv", "image,id,x0\na.png,1,2\n"));
  const auto columns = evaluate_again();
  ASSERT_FALSE(columns);
  EXPECT_EQ(columns.error().place.source, (folder_ / "truth.csv").string());
  fs::remove(folder_ / "truth.csv");
  EXPECT_FALSE(evaluate_again());
}

std::vector<std::string> score_lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

DetectionScores scores_of_two_classes() {
  DetectionScores scores{.images = 2, .truth = 8, .detections = 7, .correct = 6, .wrong_ids = 1};
  const CornerScores corners{
      .tags = 6, .rmse_px = 0.125, .worst_px = 0.5, .bias_x_px = -0.01, .bias_outward_px = 0.02};
  scores.corners = corners;
  scores.by_size = {{.low = 0, .high = 20, .truth = 4, .found = 3, .corners = corners},
                    {.low = 20, .high = 40, .truth = 0, .found = 0},
                    {.low = 40, .high = 1e6, .truth = 4, .found = 0}};
  return scores;
}

TEST(DetectionsText, PrintsTotalsAndOneRowPerClass) {
  const auto lines = score_lines(to_text(scores_of_two_classes()));
  EXPECT_THAT(lines[0], HasSubstr("8 true tags, 7 detections: 6 correct (recall 75.0 %), 1 wrong ids"));
  EXPECT_THAT(lines[1], HasSubstr("RMSE 0.1250 px"));
  const std::string all = to_text(scores_of_two_classes());
  EXPECT_THAT(all, HasSubstr("0 - 20              4     75.0   0.1250  -0.0100"));
  EXPECT_THAT(all, Not(HasSubstr("20 - 40"))) << "a class without tags is omitted";
  EXPECT_THAT(all, HasSubstr(">= 40")) << "the last class has no upper edge";
  EXPECT_THAT(all, HasSubstr("0.0        -        -        -        -")) << "no tag of this class was found";
  EXPECT_THAT(all, Not(HasSubstr("tilt"))) << "no true tag has a tilt";
}

TEST(DetectionsText, RecallBySizeAndTiltIsAGrid) {
  DetectionScores scores = scores_of_two_classes();
  scores.by_tilt = {{.low = 0, .high = 45, .truth = 6, .found = 6}, {.low = 45, .high = 90, .truth = 2}};
  for (const ClassScores& size : scores.by_size)
    scores.by_size_and_tilt.push_back({{.truth = size.truth, .found = size.found}, {}});
  const std::string all = to_text(scores);
  EXPECT_THAT(all, HasSubstr("recall %, by size (rows) and tilt (columns)"));
  EXPECT_THAT(all, HasSubstr("0-45°   45-90°"));
  EXPECT_THAT(all, HasSubstr("0 - 20             75.0        -"));
}

TEST(DetectionsText, ConsistencyIsPrintedWithTheExpectedValue) {
  DetectionScores scores = scores_of_two_classes();
  EXPECT_THAT(to_text(scores), Not(HasSubstr("covariance")));
  scores.consistency = CornerConsistency{.tags = 5, .mean_nes_corner = 2.5, .mean_nes_tag = 9.75};
  scores.unusable_covariances = 1;
  EXPECT_THAT(to_text(scores),
              HasSubstr("2.50 per corner (consistent: 2), 9.75 per tag (consistent: 8), 5 tags"));
  EXPECT_THAT(to_text(scores), HasSubstr("1 invalid"));
}

}  // namespace
}  // namespace waymark
