#include "waymark/evaluation/detections.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <string>

#include <rapidcheck.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

const std::string kHeader = "image,id,x0,y0,x1,y1,x2,y2,x3,y3";

/// Expects an error with its location and a part of its message or hint, and its text on the golden page.
void expect_error(const std::string& text, std::optional<std::int64_t> line, const std::string& column,
                  const std::string& part = "") {
  const auto truth = parse_truth(text, "truth.csv");
  ASSERT_FALSE(truth) << text;
  EXPECT_EQ(truth.error().place.source, "truth.csv");
  EXPECT_EQ(truth.error().place.line, line) << text;
  EXPECT_EQ(truth.error().place.key, column);
  EXPECT_THAT(to_string(truth.error()), HasSubstr(part));
  testing::expect_on_page("evaluate", truth.error());
}

TEST(Truth, ParsesRowsAndDefaults) {
  const auto truth =
      parse_truth("size,tilt_deg,family," + kHeader + ",extra\n" + "12,30,,a,7,0,0,10,0,10,10,0,10,?\n" +
                      ",,16h5,a,3,5,5,9,5,9,9,5,9,\n" + ",,,empty,,,,,,,,,,\n",
                  "truth.csv");
  ASSERT_TRUE(truth) << to_string(truth.error());
  ASSERT_EQ(truth->size(), 2U);
  EXPECT_TRUE(truth->at("empty").empty());
  const auto& tags = truth->at("a");
  ASSERT_EQ(tags.size(), 2U);
  EXPECT_EQ(tags[0].tag, (TagId{FamilyId::Tag36h11, 7}));
  EXPECT_EQ(tags[0].size_px, 12);
  EXPECT_EQ(tags[0].tilt_deg, 30);
  EXPECT_EQ(tags[0].corners_px[2], Eigen::Vector2d(10, 10));
  EXPECT_EQ(tags[0].corners_px[3], Eigen::Vector2d(0, 10));
  EXPECT_EQ(tags[1].tag, (TagId{FamilyId::Tag16h5, 3}));
  EXPECT_EQ(tags[1].size_px, 4);  // the mean side length, because no size is given
  EXPECT_FALSE(tags[1].tilt_deg);
}

TEST(Truth, ReportsLineColumnAndCorrection) {
  expect_error("image,id,x0,y0,x1,y1,x2,y2,x3,yy3\n", {}, "y3", "'yy3'");
  expect_error(kHeader + "\na,7,0,0,10,0,10,ten,0,10\n", 2, "y2", "'ten'");
  expect_error(kHeader + "\na,7.5,0,0,10,0,10,10,0,10\n", 2, "id", "'7.5'");
  expect_error(kHeader + "\na,587,0,0,10,0,10,10,0,10\n", 2, "id", "587");
  expect_error(kHeader + "\na,-1,0,0,10,0,10,10,0,10\n", 2, "id");
  expect_error(kHeader + "\n,1,0,0,10,0,10,10,0,10\n", 2, "image");
  expect_error(kHeader + ",family\na,1,0,0,10,0,10,10,0,10,tag36h12\n", 2, "family");
  expect_error(kHeader + ",tilt_deg\na,1,0,0,10,0,10,10,0,10,91\n", 2, "tilt_deg", "[0, 90]");
  expect_error(kHeader + ",size\na,1,0,0,10,0,10,10,0,10,-1\n", 2, "size");
}

TEST(Truth, FindsTheImageOfAPath) {
  const DetectionTruth truth = {{"A_010_0", {}}, {"left/1.png", {}}, {"1", {}}, {".hidden", {}}};
  EXPECT_EQ(find_image(truth, "data/clean/A_010_0.png"), "A_010_0");
  EXPECT_EQ(find_image(truth, "A_010_0"), "A_010_0");
  EXPECT_EQ(find_image(truth, "/x/left/1.png"), "left/1.png");  // the longest matching name is used
  EXPECT_EQ(find_image(truth, "/x/right/1.png"), "1");
  EXPECT_EQ(find_image(truth, "/x/.hidden"), ".hidden");
  EXPECT_EQ(find_image(truth, "A_010_00.png"), std::nullopt);
  EXPECT_EQ(find_image(truth, ""), std::nullopt);
}

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Corners = std::array<Eigen::Vector2d, 4>;

Corners square(double x, double y, double side) {
  return {Eigen::Vector2d(x, y), Eigen::Vector2d(x + side, y), Eigen::Vector2d(x + side, y + side),
          Eigen::Vector2d(x, y + side)};
}

TrueTag true_tag(int number, const Corners& corners, std::optional<double> tilt_deg = {}) {
  return {{FamilyId::Tag36h11, number}, corners, mean_side_px(corners), tilt_deg};
}

TagDetection detection(int number, Corners corners, const Eigen::Vector2d& shift = Eigen::Vector2d::Zero()) {
  for (auto& corner : corners) corner += shift;
  return {.tag = {FamilyId::Tag36h11, number}, .corners_px = corners};
}

TEST(Matching, ByIdForUniqueIds) {
  const std::vector<TrueTag> truth = {true_tag(1, square(0, 0, 20)), true_tag(2, square(1, 0, 20))};
  // Each detection is nearer to the position of the other tag, but the ids decide.
  const std::vector<TagDetection> found = {detection(2, square(0, 0, 20)), detection(1, square(1, 0, 20))};
  const Matching matching = match_detections(found, truth);
  EXPECT_THAT(matching.correct, ElementsAre(MatchedPair{0, 1}, MatchedPair{1, 0}));
  EXPECT_THAT(matching.missed, IsEmpty());
}

TEST(Matching, ByPositionForDuplicateIds) {
  const std::vector<TrueTag> truth = {true_tag(0, square(0, 0, 20)), true_tag(0, square(1.5, 0, 20))};
  // The first detection is within the limit of both true tags; the second is nearer to the first one.
  const std::vector<TagDetection> found = {detection(0, square(0.5, 0, 20)),
                                           detection(0, square(0.1, 0, 20))};
  const Matching matching = match_detections(found, truth);
  EXPECT_THAT(matching.correct, ElementsAre(MatchedPair{1, 0}, MatchedPair{0, 1}));
}

TEST(Matching, AnotherPositionOrRotationIsNotCorrect) {
  const std::vector<TrueTag> truth = {true_tag(1, square(0, 0, 20))};
  EXPECT_THAT(match_detections(std::vector{detection(1, square(50, 0, 20))}, truth).false_positives,
              ElementsAre(0U));
  Corners turned = square(0, 0, 20);
  std::rotate(turned.begin(), turned.begin() + 1, turned.end());
  const Matching matching = match_detections(std::vector{detection(1, turned)}, truth);
  EXPECT_THAT(matching.correct, IsEmpty());
  EXPECT_THAT(matching.wrong_id, ElementsAre(MatchedPair{0, 0}));  // decoded in the wrong rotation
  EXPECT_THAT(matching.missed, ElementsAre(0U));
}

TEST(Matching, WrongFamilyIsAWrongId) {
  const std::vector<TrueTag> truth = {true_tag(1, square(0, 0, 20))};
  TagDetection other = detection(1, square(0, 0, 20));
  other.tag.family = FamilyId::Tag25h9;
  EXPECT_THAT(match_detections(std::vector{other}, truth).wrong_id, ElementsAre(MatchedPair{0, 0}));
}

TEST(Matching, ASecondReportOfATagIsAFalsePositive) {
  const std::vector<TrueTag> truth = {true_tag(1, square(0, 0, 20))};
  const std::vector<TagDetection> found = {detection(1, square(0.5, 0, 20)),
                                           detection(1, square(0.1, 0, 20))};
  const Matching matching = match_detections(found, truth);
  EXPECT_THAT(matching.correct, ElementsAre(MatchedPair{1, 0}));
  EXPECT_THAT(matching.false_positives, ElementsAre(0U));
}

TEST(Matching, EveryIndexIsInOneList) {
  rc::check("detections and ground truth are partitioned", [] {
    Random random(*rc::gen::arbitrary<std::uint64_t>());
    std::vector<TrueTag> truth;
    std::vector<TagDetection> found;
    for (int i = 0; i < 8; ++i) {
      const Corners place = square(random.uniform(0, 60), random.uniform(0, 60), random.uniform(5, 40));
      if (random.uniform() < 0.7) truth.push_back(true_tag(static_cast<int>(random.index(3)), place));
      if (random.uniform() < 0.7) {
        found.push_back(
            detection(static_cast<int>(random.index(3)), place, {random.normal(), random.normal()}));
      }
    }
    const Matching matching = match_detections(found, truth);
    std::vector<int> uses_d(found.size()), uses_t(truth.size());
    for (const auto& [d, t] : matching.correct) ++uses_d[d], ++uses_t[t];
    for (const auto& [d, t] : matching.wrong_id) ++uses_d[d];
    for (const std::size_t d : matching.false_positives) ++uses_d[d];
    for (const std::size_t t : matching.missed) ++uses_t[t];
    for (const int uses : uses_d) RC_ASSERT(uses == 1);
    for (const int uses : uses_t) RC_ASSERT(uses == 1);
    for (const auto& [d, t] : matching.correct) RC_ASSERT(found[d].tag == truth[t].tag);
  });
}

TEST(Scores, AreEmptyWithoutImages) {
  const DetectionScores scores = score_detections({});
  EXPECT_EQ(scores.recall(), std::nullopt);
  EXPECT_FALSE(scores.corners);
  EXPECT_FALSE(scores.consistency);
  EXPECT_THAT(scores.by_tilt, IsEmpty());
  for (const ClassScores& row : scores.by_size) EXPECT_EQ(row.recall(), std::nullopt);
}

TEST(Scores, MeasureAKnownShift) {
  const ImageDetections image{
      .detections = {detection(1, square(0, 0, 20), {0.3, -0.4}), detection(9, square(100, 0, 50)),
                     detection(5, square(300, 300, 20))},
      .truth = {true_tag(1, square(0, 0, 20), 30), true_tag(2, square(100, 0, 50), 0),
                true_tag(3, square(0, 100, 12), 75)}};
  const DetectionScores scores = score_detections(std::vector{image, image});
  EXPECT_EQ(scores.images, 2U);
  EXPECT_EQ(scores.truth, 6U);
  EXPECT_EQ(scores.detections, 6U);
  EXPECT_EQ(scores.correct, 2U);
  EXPECT_EQ(scores.wrong_ids, 2U);
  EXPECT_EQ(scores.false_positives, 2U);
  EXPECT_DOUBLE_EQ(scores.recall().value_or(0), 1.0 / 3);
  const CornerScores corners = scores.corners.value_or(CornerScores{});
  EXPECT_NEAR(corners.rmse_px, 0.5, 1e-12);
  EXPECT_NEAR(corners.worst_px, 0.5, 1e-12);
  EXPECT_NEAR(corners.rmse_x_px, 0.3, 1e-12);
  EXPECT_NEAR(corners.rmse_y_px, 0.4, 1e-12);
  EXPECT_NEAR(corners.bias_x_px, 0.3, 1e-12);
  EXPECT_NEAR(corners.bias_y_px, -0.4, 1e-12);
  EXPECT_NEAR(corners.bias_outward_px, 0, 1e-12);
  EXPECT_FALSE(scores.consistency);
  std::size_t truth = 0;
  for (const auto& row : scores.by_size_and_tilt) {
    for (const ClassScores& cell : row) truth += cell.truth;
  }
  EXPECT_EQ(truth, scores.truth);
}

TEST(Scores, UnreliableCornersAreCountedButNotInTheErrors) {
  ImageDetections image{
      .detections = {detection(1, square(0, 0, 20), {0.3, -0.4}), detection(2, square(100, 0, 50), {3, 4})},
      .truth = {true_tag(1, square(0, 0, 20)), true_tag(2, square(100, 0, 50))}};
  image.detections[1].corner_state = CornerState::Unreliable;
  const DetectionScores scores = score_detections(std::vector{image});
  EXPECT_EQ(scores.correct, 2U);
  EXPECT_EQ(scores.unreliable, 1U);
  ASSERT_TRUE(scores.corners);
  EXPECT_EQ(scores.corners->tags, 1U);
  EXPECT_NEAR(scores.corners->worst_px, 0.5, 1e-12);
}

TEST(Scores, OutwardBiasMeasuresEnlargedTags) {
  const TrueTag truth = true_tag(1, square(10, 10, 20));
  const double grow = 0.1 / std::sqrt(2.0);
  const ImageDetections image{.detections = {detection(1, square(10 - grow, 10 - grow, 20 + 2 * grow))},
                              .truth = {truth}};
  const DetectionScores scores = score_detections(std::vector{image});
  const CornerScores corners = scores.corners.value_or(CornerScores{});
  EXPECT_NEAR(corners.bias_outward_px, 0.1, 1e-12);
  EXPECT_NEAR(corners.bias_x_px, 0, 1e-12);
}

TEST(Scores, ClassesIncludeTheirLowerEdgeAndTheLastItsUpperEdge) {
  const ClassEdges edges{.size_px = {10, 20, 40}, .tilt_deg = {0, 45, 90}};
  ASSERT_TRUE(check_edges(edges));
  ImageDetections image;
  int number = 0;
  for (const double size : {9.0, 10.0, 20.0, 40.0, 41.0})
    image.truth.push_back(true_tag(number++, square(0, 0, size), 90));
  const DetectionScores scores = score_detections(std::vector{image}, {}, edges);
  ASSERT_EQ(scores.by_size.size(), 2U);
  EXPECT_EQ(scores.by_size[0].truth, 1U);
  EXPECT_EQ(scores.by_size[1].truth, 2U);
  EXPECT_EQ(scores.by_tilt[1].truth,
            5U);  // a size outside all classes does not exclude the tag from the tilt classes
}

TEST(Scores, InvalidEdgesAreRejected) {
  EXPECT_FALSE(check_edges({.size_px = {1}}));
  EXPECT_FALSE(check_edges({.size_px = {1, 1}}));
  EXPECT_FALSE(check_edges({.tilt_deg = {0, std::numeric_limits<double>::quiet_NaN()}}));
  EXPECT_EQ(check_edges({.tilt_deg = {3, 2}}).error().place.key, "tilt_edges_deg");
}

TEST(Scores, ConsistentCovariancesGiveTheirDegreesOfFreedom) {
  constexpr int kTags = 4000;
  Random random(7);
  CornerCovariance root;
  for (Eigen::Index i = 0; i < root.size(); ++i) root(i) = 0.02 * random.normal();
  root.diagonal().array() += 0.1;
  std::vector<ImageDetections> images;
  for (int n = 0; n < kTags; ++n) {
    Eigen::Matrix<double, 8, 1> z;
    for (Eigen::Index i = 0; i < 8; ++i) z(i) = random.normal();
    const Eigen::Matrix<double, 8, 1> e = root * z;
    TagDetection found = detection(1, square(0, 0, 50));
    for (std::size_t i = 0; i < 4; ++i) found.corners_px[i] += e.segment<2>(2 * static_cast<Eigen::Index>(i));
    found.corner_covariance_px2 = root * root.transpose();
    images.push_back({.detections = {found}, .truth = {true_tag(1, square(0, 0, 50))}});
  }
  images.push_back(images.front());
  images.back().detections.front().corner_covariance_px2 = CornerCovariance::Zero();
  const DetectionScores scores = score_detections(images);
  const CornerConsistency consistency = scores.consistency.value_or(CornerConsistency{});
  EXPECT_EQ(consistency.tags, static_cast<std::size_t>(kTags));
  EXPECT_EQ(scores.unusable_covariances, 1U);
  // Chi-square with k degrees of freedom has variance 2k; the tolerance is 4 standard deviations of the mean.
  EXPECT_NEAR(consistency.mean_nes_tag, 8, 4 * std::sqrt(16.0 / kTags));
  EXPECT_NEAR(consistency.mean_nes_corner, 2,
              4 * std::sqrt(4.0 / kTags));  // the corners of one tag are correlated
}

}  // namespace
}  // namespace waymark
