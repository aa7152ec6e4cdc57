// The tables of detections and their scores: each figure in its column, and nothing where nothing is known.
#include "waymark/app/detect/detections_text.hpp"

#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TagDetection square(int number, double left_px, double side_px) {
  TagDetection tag{.tag = {FamilyId::Tag36h11, number}, .hamming = 1, .decision_margin = 61.25};
  tag.corners_px = {Eigen::Vector2d(left_px, 100), Eigen::Vector2d(left_px + side_px, 100),
                    Eigen::Vector2d(left_px + side_px, 100 + side_px),
                    Eigen::Vector2d(left_px, 100 + side_px)};
  return tag;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream stream(line);
  return {std::istream_iterator<std::string>(stream), {}};
}

TEST(DetectionsText, APictureIsARowATag) {
  PictureReport report{.image = "a.png", .width_px = 640, .height_px = 480, .detected = true};
  EXPECT_EQ(to_text(report), "a.png: 0 tags in 640 x 480 px\n");
  report.detections = {square(3, 50, 40)};
  EXPECT_THAT(to_text(report), HasSubstr("a.png: 1 tag in"));
  report.detections.push_back(square(7, 200, 25));
  report.detections[1].corner_covariance_px2 = 0.04 * Eigen::Matrix<double, 8, 8>::Identity();
  const auto lines = lines_of(to_text(report));
  ASSERT_EQ(lines.size(), 4U);
  const auto first = words_of(lines[2]);
  EXPECT_EQ(first, (std::vector<std::string>{"tag36h11:3", "70.00", "120.00", "40.0", "-", "61.2", "1"}));
  EXPECT_EQ(words_of(lines[3])[4], "0.200") << "the root of the mean variance of a coordinate";
}

TEST(DetectionsText, CornersThatAreNotRefinedAreSaidWithWhy) {
  PictureReport report{.image = "a.png", .width_px = 640, .height_px = 480, .detected = true};
  report.detections = {square(3, 50, 40), square(4, 150, 40)};
  report.refinements = {RefinementOutcome::Refined, RefinementOutcome::TooSmall};
  const auto lines = lines_of(to_text(report));
  EXPECT_THAT(lines[2], Not(HasSubstr("not refined")));
  EXPECT_THAT(lines[3], HasSubstr(std::string("corners not refined: ") +
                                  std::string(to_string(RefinementOutcome::TooSmall))));
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

TEST(DetectionsText, ScoresAreSumsAndARowAClass) {
  const auto lines = lines_of(to_text(scores_of_two_classes()));
  EXPECT_THAT(lines[0], HasSubstr("8 true tags, 7 reported: 6 correct (recall 75.0 %), 1 wrong ids"));
  EXPECT_THAT(lines[1], HasSubstr("RMSE 0.1250 px"));
  const std::string all = to_text(scores_of_two_classes());
  EXPECT_THAT(all, HasSubstr("0 - 20              4     75.0   0.1250  -0.0100"));
  EXPECT_THAT(all, Not(HasSubstr("20 - 40"))) << "a class without tags says nothing";
  EXPECT_THAT(all, HasSubstr(">= 40")) << "the last class has no upper edge";
  EXPECT_THAT(all, HasSubstr("0.0        -        -        -        -")) << "none of its tags was found";
  EXPECT_THAT(all, Not(HasSubstr("tilt"))) << "no true tag says how it leans";
}

TEST(DetectionsText, RecallBySizeAndTiltIsAGrid) {
  DetectionScores scores = scores_of_two_classes();
  scores.by_tilt = {{.low = 0, .high = 45, .truth = 6, .found = 6}, {.low = 45, .high = 90, .truth = 2}};
  for (const ClassScores& size : scores.by_size)
    scores.by_size_and_tilt.push_back({{.truth = size.truth, .found = size.found}, {}});
  const std::string all = to_text(scores);
  EXPECT_THAT(all, HasSubstr("recall %, by size across and tilt"));
  EXPECT_THAT(all, HasSubstr("0-45°   45-90°"));
  EXPECT_THAT(all, HasSubstr("0 - 20             75.0        -"));
}

TEST(DetectionsText, ConsistencyIsSaidWithWhatIsExpected) {
  DetectionScores scores = scores_of_two_classes();
  EXPECT_THAT(to_text(scores), Not(HasSubstr("covariance")));
  scores.consistency = CornerConsistency{.tags = 5, .mean_nes_corner = 2.5, .mean_nes_tag = 9.75};
  scores.unusable_covariances = 1;
  EXPECT_THAT(to_text(scores),
              HasSubstr("2.50 a corner (consistent: 2), 9.75 a tag (consistent: 8), 5 tags"));
  EXPECT_THAT(to_text(scores), HasSubstr("1 are not positive definite"));
}

TEST(DetectionsText, PosesHaveBothSolutionsAndErrorsTheirWords) {
  EXPECT_EQ(to_text(std::span<const TagDetection>(), PoseList()), "");
  const std::vector<TagDetection> tags = {square(3, 50, 40), square(4, 150, 40)};
  TagPose pose;
  pose.best.cam_T_tag = SE3(SO3(), {0.1, -0.2, 2});
  pose.best.covariance = 1e-6 * PoseCovariance::Identity();
  pose.best.rms_px = 0.1;
  pose.other = pose.best;
  pose.other->rms_px = 0.4;
  PoseList poses;
  poses.emplace_back(pose);
  poses.emplace_back(fail(ErrorCode::InvalidArgument, "its size is not known"));
  const auto lines = lines_of(to_text(tags, poses));
  ASSERT_EQ(lines.size(), 4U);
  const auto first = words_of(lines[1]);
  EXPECT_EQ(std::vector<std::string>(first.begin(), first.begin() + 7),
            (std::vector<std::string>{"tag36h11:3", "0.1000", "-0.2000", "2.0000", "2.2", "2.2", "1.0"}))
      << "1 mm, and 1 mrad about the camera at 2 m";
  EXPECT_THAT(lines[2], HasSubstr("or (ratio "));
  EXPECT_THAT(lines[3], HasSubstr("its size is not known"));
}

}  // namespace
}  // namespace waymark
