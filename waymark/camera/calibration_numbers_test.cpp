#include "waymark/camera/calibration_numbers.hpp"

#include <string>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using ::testing::HasSubstr;

CalibrationNumbers some_numbers() {
  return {.model = "plumb_bob",
          .k = {500, 0, 319.5, 0, 501, 239.5, 0, 0, 1},
          .distortion = {0.1, -0.2, 0.001, -0.002, 0.05},
          .width_px = 640,
          .height_px = 480};
}

std::string key_of_error(const CalibrationNumbers& numbers) {
  const auto camera = camera_from(numbers);
  return camera ? "no error" : camera.error().place.key;
}

TEST(CalibrationNumbers, AddsHalfAPixel) {
  const auto camera = camera_from(some_numbers());
  ASSERT_TRUE(camera) << to_string(camera.error());
  const PinholeRadtan expected{
      .fx = 500, .fy = 501, .cx = 320, .cy = 240, .k = {0.1, -0.2, 0.001, -0.002, 0.05}, .coefficients = 5};
  EXPECT_EQ(camera->projection(), CameraModel::Projection(expected));
}

// A pixel of the part is that of the full image, moved by the region of interest, then binned.
TEST(CalibrationNumbers, BinningAndRegionMoveEveryPixel) {
  const CameraModel full = camera_from(some_numbers()).value();
  CalibrationNumbers numbers = some_numbers();
  numbers.part = {.x_px = 80, .y_px = 60, .width_px = 480, .height_px = 360, .binning_x = 2, .binning_y = 3};
  const auto part = camera_from(numbers);
  ASSERT_TRUE(part) << to_string(part.error());
  EXPECT_EQ(part->width_px(), 240);
  EXPECT_EQ(part->height_px(), 120);
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.1, -0.2, 1), Eigen::Vector3d(-0.3, 0.2, 0.9)}) {
    const Eigen::Vector2d expected =
        (*full.project(p) - Eigen::Vector2d(80, 60)).cwiseQuotient(Eigen::Vector2d(2, 3));
    EXPECT_LT((*part->project(p) - expected).norm(), 1e-9);
  }
  numbers.part = {.binning_x = 2, .binning_y = 2};
  EXPECT_EQ(camera_from(numbers)->width_px(), 320) << "without a region, the whole image is sent";
  numbers.part = {.x_px = 200, .width_px = 480, .height_px = 480};
  EXPECT_EQ(key_of_error(numbers), "roi");
}

TEST(CalibrationNumbers, SkewMovesPixelsAlongARow) {
  for (const char* model : {"radtan", "equidistant"}) {
    CalibrationNumbers numbers = some_numbers();
    numbers.model = model;
    numbers.distortion = {0.01, 0.002, 0.0, 0.0};
    const CameraModel straight = camera_from(numbers).value();
    numbers.k[1] = -6;
    const CameraModel skewed = camera_from(numbers).value();
    const Eigen::Vector3d p(0.3, -0.4, 1.1);
    const Eigen::Vector2d px = *straight.project(p);
    const double y = (px.y() - 240) / 501;
    EXPECT_LT((*skewed.project(p) - px - Eigen::Vector2d(-6 * y, 0)).norm(), 1e-9) << model;
    EXPECT_LT((skewed.unproject(*skewed.project(p)).value() - p.normalized()).norm(), 1e-12) << model;
  }
  CalibrationNumbers swapped = some_numbers();
  swapped.k[1] = 319.5;
  EXPECT_EQ(key_of_error(swapped), "skew");
}

TEST(CalibrationNumbers, TheNumberOfCoefficientsSelectsTheForm) {
  for (const std::size_t n : {0U, 4U, 5U, 8U}) {
    CalibrationNumbers numbers = some_numbers();
    numbers.distortion.resize(n);
    for (const char* model : {"plumb_bob", "rational_polynomial", "radtan", ""}) {
      numbers.model = model;
      const auto camera = camera_from(numbers);
      ASSERT_TRUE(camera) << model << n << to_string(camera.error());
      EXPECT_EQ(std::get<PinholeRadtan>(camera->projection()).coefficients, static_cast<int>(n));
    }
  }
  CalibrationNumbers numbers = some_numbers();
  for (const std::size_t n : {1U, 3U, 6U, 13U, 15U}) {
    numbers.distortion.assign(n, 0.0);
    EXPECT_EQ(key_of_error(numbers), "distortion") << n;
  }
}

TEST(CalibrationNumbers, ThinPrismAndTiltMustBeZero) {
  for (const std::size_t n : {12U, 14U}) {
    CalibrationNumbers numbers = some_numbers();
    numbers.distortion.resize(n);
    EXPECT_EQ(std::get<PinholeRadtan>(camera_from(numbers)->projection()).coefficients, 8);
    numbers.distortion.back() = 0.03;
    EXPECT_EQ(key_of_error(numbers), "distortion");
  }
}

TEST(CalibrationNumbers, AcceptsEverySpellingOfAModel) {
  CalibrationNumbers numbers = some_numbers();
  numbers.distortion = {0.01, 0.002, 0.0, 0.0};
  for (const char* model : {"equidistant", "Fisheye", "kannala_brandt", "KANNALA-BRANDT", "equi"}) {
    numbers.model = model;
    const auto camera = camera_from(numbers);
    ASSERT_TRUE(camera) << model;
    EXPECT_TRUE(std::holds_alternative<Equidistant>(camera->projection())) << model;
  }
  for (const char* model : {"Plumb Bob", "radial-tangential", "brown_conrady"}) {
    numbers.model = model;
    EXPECT_TRUE(camera_from(numbers)) << model;
  }
  numbers.model = "plum_bob";
  EXPECT_EQ(key_of_error(numbers), "distortion_model");
  EXPECT_THAT(camera_from(numbers).error().hint, HasSubstr("plumb_bob"));
  numbers.model = "none";
  EXPECT_EQ(key_of_error(numbers), "distortion");
  numbers.distortion.clear();
  EXPECT_TRUE(camera_from(numbers));
}

TEST(CalibrationNumbers, RejectsInvalidMatricesAndSizes) {
  CalibrationNumbers numbers = some_numbers();
  numbers.k[8] = 2;
  EXPECT_EQ(key_of_error(numbers), "camera_matrix");
  numbers = some_numbers();
  numbers.width_px = 0;
  EXPECT_EQ(key_of_error(numbers), "resolution");
}

/// Wide lenses are accepted: a pinhole model up to 160 degrees, a fisheye up to 220 degrees and beyond.
TEST(CalibrationNumbers, RejectsFocalLengthsInMillimetres) {
  CalibrationNumbers numbers = some_numbers();
  numbers.distortion.clear();
  numbers.k[0] = numbers.k[4] = 3.6;
  EXPECT_EQ(key_of_error(numbers), "camera_matrix");
  numbers.k[0] = numbers.k[4] = 57;
  EXPECT_EQ(key_of_error(numbers), "no error");
  numbers.model = "equidistant";
  numbers.k[0] = numbers.k[4] = 166;
  EXPECT_EQ(key_of_error(numbers), "no error");
  numbers.k[0] = numbers.k[4] = 8;
  EXPECT_EQ(key_of_error(numbers), "camera_matrix");
}

}  // namespace
}  // namespace waymark
