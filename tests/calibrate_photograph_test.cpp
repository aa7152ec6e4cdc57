// Calibration from pixels: rendered photographs of a board through a distorting lens are detected, refined
// and calibrated; the parameters must agree with the ground truth within their uncertainty.
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/mapping/camera/camera_calibration.hpp"
#include "waymark/simulation/render/photograph.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

constexpr int kColumns = 6;
constexpr int kRows = 5;
constexpr double kSizeM = 0.04;
constexpr double kPitchM = 0.052;

SE3 board_T_tag(int number) {
  const double x_m = kPitchM * (number % kColumns - 0.5 * (kColumns - 1));
  const double y_m = kPitchM * (number / kColumns - 0.5 * (kRows - 1));
  return {SO3(), {x_m, y_m, 0}};
}

TEST(CalibrationFromPhotographs, FindsTheCameraWithinItsUncertainty) {
  constexpr std::uint64_t kSeed = 8;
  const PinholeRadtan lens{
      .fx = 620, .fy = 617, .cx = 329, .cy = 236, .k = {-0.25, 0.07, 0.0008, -0.0006}, .coefficients = 4};
  const CameraModel truth = CameraModel::make(lens, 640, 480).value();
  TagMap board;
  for (int i = 0; i < kColumns * kRows; ++i)
    board.tags.emplace(TagId{FamilyId::Tag36h11, i},
                       MappedTag{.map_T_tag = board_T_tag(i), .size_m = kSizeM});
  const TagFinder finder = make_tag_finder().value();
  Random random(kSeed);
  std::vector<std::vector<TagDetection>> images;
  for (int image = 0; image < 12; ++image) {
    const double about = 2 * std::numbers::pi * image / 12;
    const SE3 cam_T_board(SO3::exp({0.5 * std::cos(about), 0.5 * std::sin(about), random.uniform(-0.3, 0.3)}),
                          {0.07 * std::sin(about), -0.05 * std::cos(about), random.uniform(0.34, 0.5)});
    PhotographScene scene;
    for (int i = 0; i < kColumns * kRows; ++i)
      scene.tags.push_back({{FamilyId::Tag36h11, i}, cam_T_board * board_T_tag(i), kSizeM});
    images.push_back(
        find_tags(photograph(truth, scene, {}, random).value().image, finder, ImageLens::unknown())
            .value()
            .detections);
  }
  const auto found = calibrate_camera(images, board, 640, 480, LensModel::Radtan4);
  ASSERT_TRUE(found) << to_string(found.error());
  const double sigma_fx = std::sqrt(found->covariance(0, 0));
  const double sigma_cx = std::sqrt(found->covariance(2, 2));
  std::printf("fx %.3f +- %.3f, cx %.3f +- %.3f, held out %.4f px, noise %.2f of the corner covariances\n",
              found->parameters[0], sigma_fx, found->parameters[2], sigma_cx, found->held_out_rms_px,
              found->noise_scale);
  EXPECT_NEAR(found->parameters[0], lens.fx, 4 * sigma_fx);
  EXPECT_NEAR(found->parameters[1], lens.fy, 4 * std::sqrt(found->covariance(1, 1)));
  EXPECT_NEAR(found->parameters[2], lens.cx, 4 * sigma_cx);
  EXPECT_NEAR(found->parameters[3], lens.cy, 4 * std::sqrt(found->covariance(3, 3)));
  EXPECT_LT(sigma_fx, 0.5);
  EXPECT_NEAR(found->noise_scale, 1, 0.2);  // the covariance of the corner refinement is consistent
  EXPECT_LT(found->held_out_rms_px, 1.1 * found->rms_px);
}

}  // namespace
}  // namespace waymark
