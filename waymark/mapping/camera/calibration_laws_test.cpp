// Invariants of the calibration of every camera. The order of images and the target's unit of length, frame
// and rotation do not matter. The covariance scales with the noise. The calibration that is written equals
// the result.
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include "waymark/base/angles.hpp"
#include "waymark/base/random.hpp"
#include "waymark/mapping/camera/camera_calibration.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 640;
constexpr int kHeight = 480;

CameraModel truth() {
  return CameraModel::make(
             PinholeRadtan{.fx = 512, .fy = 509, .cx = 326, .cy = 236, .k = {-0.25, 0.08}, .coefficients = 4},
             kWidth, kHeight)
      .value();
}

/// Images of a board of 9 x 6 corners taken from all sides.
std::vector<TargetMarks> images(std::uint64_t seed, double noise_px, std::size_t count = 12) {
  Random random(seed);
  std::vector<TargetMarks> all;
  for (std::size_t i = 0; i < count; ++i) {
    const SO3 turn =
        SO3::exp({0.7 * random.uniform(-1, 1), 0.7 * random.uniform(-1, 1), random.uniform(-1, 1)});
    const double depth_m = random.uniform(0.25, 0.5);
    const SE3 cam_T_board(
        turn, {depth_m * random.uniform(-0.3, 0.3), depth_m * random.uniform(-0.2, 0.2), depth_m});
    TargetMarks marks;
    for (int k = 0; k < 54; ++k) {
      const Eigen::Vector3d place(0.025 * (k % 9 - 4), 0.025 * (k / 9 - 2.5), 0);
      const auto px = truth().project(cam_T_board * place);
      Eigen::Vector2d noise(random.normal(), 0);
      noise.y() = random.normal();
      if (px && truth().contains(*px))
        marks.push_back({.key = k, .target_points_m = {place}, .seen_px = {*px + noise_px * noise}});
    }
    all.push_back(std::move(marks));
  }
  return all;
}

CameraCalibration calibrated(const std::vector<TargetMarks>& views,
                             const CameraCalibrationOptions& options = {}) {
  auto found = calibrate_camera(views, kWidth, kHeight, LensModel::Radtan4, options);
  EXPECT_TRUE(found) << to_string(found.error());
  return found ? std::move(*found) : CameraCalibration{.camera = truth()};
}

/// The distance between two results in standard deviations.
double apart(const CameraCalibration& a, const CameraCalibration& b) {
  return (a.parameters - b.parameters)
      .cwiseQuotient(a.covariance.diagonal().cwiseSqrt())
      .cwiseAbs()
      .maxCoeff();
}

TEST(CalibrationLaws, TheOrderOfImagesAndMarksDoesNotMatter) {
  const auto views = images(1, 0.1);
  auto mixed = views;
  std::ranges::rotate(mixed, mixed.begin() + 5);
  for (TargetMarks& view : mixed) std::ranges::reverse(view);
  const CameraCalibration a = calibrated(views);
  const CameraCalibration b = calibrated(mixed);
  EXPECT_LT(apart(a, b), 0.01);
  EXPECT_NEAR(b.rms_px, a.rms_px, 1e-4);
  ASSERT_EQ(b.views.size(), a.views.size());
  EXPECT_NEAR(b.views[0].distance_m, a.views[5].distance_m, 1e-4);
}

TEST(CalibrationLaws, ALargerBoardScalesDistancesAndNotTheCamera) {
  const auto views = images(2, 0.1);
  auto large = views;
  for (TargetMarks& view : large) {
    for (TargetMark& mark : view) mark.target_points_m[0] *= 2;
  }
  const CameraCalibration a = calibrated(views);
  const CameraCalibration b = calibrated(large);
  EXPECT_LT(apart(a, b), 0.01);
  for (std::size_t i = 0; i < views.size(); ++i) {
    EXPECT_NEAR(b.views[i].distance_m, 2 * a.views[i].distance_m, 1e-4);
    EXPECT_NEAR(b.views[i].tilt_deg, a.views[i].tilt_deg, 0.01);
  }
}

TEST(CalibrationLaws, TheOriginOfTheBoardDoesNotMatter) {
  const auto views = images(3, 0.1);
  auto moved = views;
  const SE3 by(SO3::exp({0, 0, 0.7}), {0.4, -0.3, 0});  // a motion within the target plane
  for (TargetMarks& view : moved) {
    for (TargetMark& mark : view) mark.target_points_m[0] = by * mark.target_points_m[0];
  }
  const CameraCalibration a = calibrated(views);
  const CameraCalibration b = calibrated(moved);
  EXPECT_LT(apart(a, b), 0.01);
  for (std::size_t i = 0; i < views.size(); ++i)
    EXPECT_NEAR(b.views[i].distance_m, a.views[i].distance_m, 1e-4);
}

TEST(CalibrationLaws, TheCovarianceIsPositiveDefiniteAndScalesWithTheNoise) {
  const CameraCalibration fine = calibrated(images(4, 0.05));
  const CameraCalibration rough = calibrated(images(4, 0.2));
  for (const CameraCalibration* found : {&fine, &rough}) {
    const Eigen::MatrixXd& P = found->covariance;
    ASSERT_EQ(P.rows(), found->parameters.size());
    EXPECT_LT((P - P.transpose()).norm(), 1e-9 * P.norm());
    const Eigen::VectorXd sigma = P.diagonal().cwiseSqrt();
    const Eigen::MatrixXd correlation =
        sigma.cwiseInverse().asDiagonal() * P * sigma.cwiseInverse().asDiagonal();
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation).eigenvalues().minCoeff(), 0);
  }
  EXPECT_NEAR(std::sqrt(rough.covariance(0, 0) / fine.covariance(0, 0)), 4, 0.6);
  EXPECT_NEAR(rough.noise_scale, 1, 0.1) << "0.2 px is the assumed noise";
  EXPECT_NEAR(fine.noise_scale, 0.25, 0.03);
}

TEST(CalibrationLaws, TheAssumedNoiseDoesNotChangeTheResult) {
  const auto views = images(5, 0.1);
  const CameraCalibration a = calibrated(views);
  const CameraCalibration b = calibrated(views, {.corner_sigma_px = 0.4});
  EXPECT_LT(apart(a, b), 0.3);
  EXPECT_NEAR(b.noise_scale, a.noise_scale / 2, 0.02);
  EXPECT_NEAR(std::sqrt(b.covariance(0, 0) / a.covariance(0, 0)), 1, 0.1);
}

TEST(CalibrationLaws, AnImageWithTooFewCornersIsUnusedAndKeepsItsIndex) {
  auto views = images(6, 0.1);
  views[3].resize(7);
  const CameraCalibration found = calibrated(views);
  ASSERT_EQ(found.views.size(), views.size());
  EXPECT_EQ(found.views[3].marks, 0U);
  EXPECT_TRUE(found.views[3].used.empty());
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i == 3) continue;
    EXPECT_EQ(found.views[i].marks + found.views[i].rejected, views[i].size()) << i;
    EXPECT_EQ(found.views[i].used.size(), views[i].size()) << i;
  }
}

TEST(CalibrationLaws, RegionsAddUpToTheWholeImage) {
  const CameraCalibration found = calibrated(images(7, 0.1));
  std::size_t corners = 0;
  double squares = 0;
  for (const ImageRegion& region : found.regions) {
    corners += region.corners;
    squares += static_cast<double>(region.corners) * region.rms_px * region.rms_px;
  }
  std::size_t marks = 0;
  for (const CalibratedView& view : found.views) marks += view.marks;
  EXPECT_EQ(corners, marks);
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(corners)), found.rms_px, 1e-9);
}

TEST(CalibrationLaws, TheWrittenCalibrationEqualsTheResult) {
  const CameraCalibration found = calibrated(images(8, 0.1));
  const Calibration written = to_calibration(found);
  ASSERT_TRUE(written.camera);
  const Eigen::Vector3d p(0.1, -0.05, 1);
  EXPECT_LT((*written.camera->project(p) - *found.camera.project(p)).norm(), 1e-9);
  ASSERT_EQ(found.names.size(), 8U);
  for (std::size_t i = 0; i < found.names.size(); ++i) {
    const auto value = written.values.find(found.names[i]);
    ASSERT_NE(value, written.values.end()) << found.names[i];
    const auto k = static_cast<Eigen::Index>(i);
    EXPECT_EQ(value->second.value, found.parameters[k]);
    EXPECT_NEAR(value->second.sigma, std::sqrt(found.covariance(k, k)), 1e-12);
    for (Eigen::Index j = 0; j < found.parameters.size(); ++j) {
      const double scale = std::sqrt(found.covariance(k, k) * found.covariance(j, j));
      EXPECT_NEAR(written.camera_correlations(k, j), found.covariance(k, j) / scale, 1e-12);
    }
  }
}

TEST(CalibrationLaws, OptionsOutOfRangeAreReported) {
  const auto found = calibrate_camera(images(9, 0.1), kWidth, kHeight, LensModel::Radtan4, {.folds = 1});
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().place.key, HasSubstr("folds"));
  EXPECT_FALSE(calibrate_camera(images(9, 0.1), 0, kHeight, LensModel::Radtan4))
      << "an image cannot have zero width";
}

}  // namespace
}  // namespace waymark
