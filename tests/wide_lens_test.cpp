// Corners of tags seen through wide lenses, up to 60 degrees off the axis. The edges of near tags are curved
// by many pixels. The normalised squared error must match eight degrees of freedom.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/corner_table.hpp"
#include "waymark/simulation/render/photograph.hpp"
#include "waymark/tags/straight_view.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

CameraModel fisheye() {
  return CameraModel::make(
             Equidistant{.fx = 444, .fy = 444, .cx = 640, .cy = 480, .k = {0.0368, 0.0091, -0.0097, -0.01}},
             1280, 960)
      .value();
}

CameraModel barrel() {
  return CameraModel::make(
             PinholeRadtan{
                 .fx = 620, .fy = 620, .cx = 640, .cy = 360, .k = {-0.33, 0.11, 0, 0, 0}, .coefficients = 5},
             1280, 720)
      .value();
}

/// Tags of 16 cm at these angles off the axis, 0.4 to 1.2 m away, tilted by up to 40 degrees.
PhotographScene scene_of(const std::vector<double>& off_axis_deg, Random& random) {
  PhotographScene scene;
  int number = 0;
  for (const double off : off_axis_deg) {
    const double around = 2 * std::numbers::pi * (number + random.uniform(-0.1, 0.1)) /
                          static_cast<double>(off_axis_deg.size());
    const SO3 aim = SO3::exp(off * kDegree * Eigen::Vector3d(std::cos(around), std::sin(around), 0));
    const double about = random.uniform(0, 2 * std::numbers::pi);
    const SO3 tilt =
        SO3::exp(random.uniform(0, 40) * kDegree * Eigen::Vector3d(std::cos(about), std::sin(about), 0));
    const SO3 roll = SO3::exp({0, 0, random.uniform(0, 2 * std::numbers::pi)});
    scene.tags.push_back({{FamilyId::Tag36h11, number++},
                          SE3(aim * tilt * roll, aim * Eigen::Vector3d(0, 0, random.uniform(0.4, 1.2))),
                          0.16});
  }
  return scene;
}

struct Outcome {
  int tags = 0;  ///< entirely visible
  int refined = 0;
  int far_off = 0;               ///< corners; see testing::corners_far_off()
  int curved = 0;                ///< refined, with edges that bulge by more than a pixel
  double squared_error_px2 = 0;  ///< mean over the corners, summed over the refined tags
  double nees = 0;               ///< per degree of freedom, summed over the refined tags with curved edges

  [[nodiscard]] double rmse_px() const { return std::sqrt(squared_error_px2 / refined); }
};

void add(const FoundTags& found, const TagTruth& truth, const CameraModel& camera, Outcome& outcome) {
  ++outcome.tags;
  for (std::size_t i = 0; i < found.detections.size(); ++i) {
    const TagDetection& tag = found.detections[i];
    if (tag.tag != truth.tag) continue;
    Eigen::Matrix<double, 8, 1> error;
    for (std::size_t k = 0; k < 4; ++k)
      error.segment<2>(2 * static_cast<Eigen::Index>(k)) = tag.corners_px.at(k) - truth.corners_px.at(k);
    ASSERT_TRUE(tag.corner_covariance_px2);
    const double squared = error.dot(tag.corner_covariance_px2->llt().solve(error));
    outcome.far_off += testing::corners_far_off(error, *tag.corner_covariance_px2);
    if (found.refinements.at(i) != RefinementOutcome::Refined) continue;
    ++outcome.refined;
    outcome.squared_error_px2 += error.squaredNorm() / 4;
    if (edge_bulge_px(camera, truth.corners_px).value_or(0) < 1) continue;
    ++outcome.curved;
    outcome.nees += squared / 8;
  }
}

/// Photographs with one tag at each of these angles off the axis.
Outcome photographed(const CameraModel& camera, const std::vector<double>& off_axis_deg) {
  const int images = std::getenv("WAYMARK_FULL") != nullptr ? 100 : 12;
  const TagFinder finder = make_tag_finder(DetectorOptions{}).value();
  Outcome outcome;
  for (int i = 0; i < images; ++i) {
    Random random(500 + static_cast<std::uint64_t>(i));
    const auto photo = photograph(camera, scene_of(off_axis_deg, random), {}, random);
    const auto found = find_tags(photo.value().image, finder, ImageLens::of(camera));
    for (const TagTruth& truth : photo->tags)
      if (truth.visible_fraction == 1) add(found.value(), truth, camera, outcome);
  }
  std::printf("%d tags, %d refined (%d with curved edges), RMSE %.3f px, NEES/8 %.2f\n", outcome.tags,
              outcome.refined, outcome.curved, outcome.rmse_px(), outcome.nees / outcome.curved);
  return outcome;
}

void expect_right(const Outcome& outcome) {
  EXPECT_GE(outcome.refined, 0.97 * outcome.tags);
  EXPECT_EQ(outcome.far_off, 0);
  EXPECT_LT(outcome.rmse_px(), 0.03);
  ASSERT_GE(outcome.curved, 12);
  EXPECT_GT(outcome.nees / outcome.curved, 0.5);
  EXPECT_LT(outcome.nees / outcome.curved, 2);
}

TEST(WideLens, CornersAreRightUpTo58DegreesOffTheAxisOfAFisheye) {
  expect_right(photographed(fisheye(), {0, 25, 35, 45, 52, 58}));
}

TEST(WideLens, CornersAreRightWithBarrelDistortion) {
  expect_right(photographed(barrel(), {0, 15, 25, 32, 38}));
}

}  // namespace
}  // namespace waymark
