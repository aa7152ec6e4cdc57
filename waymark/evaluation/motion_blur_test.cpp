// Tests black squares with known blur from lens, pixel and motion.
#include "waymark/evaluation/motion_blur.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

constexpr double kSide_px = 61;  // the cells are 7.6 px wide
constexpr int kImageWidth = 320;
constexpr int kImageHeight = 240;
const TagId kSquare{FamilyId::Tag36h11, 3};

double below(double x, double sigma) { return 0.5 * std::erfc(-x / (sigma * std::numbers::sqrt2)); }

/// Fraction of the pixel at x that is covered by the square, whose left side is at `left`.
double shadow(double x, double left, double sigma) {
  return below(x - left, sigma) - below(x - left - kSide_px, sigma);
}

TagFrame frame_at(double left, double top, double stamp_s) {
  TagFrame frame{
      .stamp = SensorTime(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(stamp_s)))};
  TagDetection seen{.tag = kSquare};
  seen.corners_px = {Eigen::Vector2d(left, top), Eigen::Vector2d(left + kSide_px, top),
                     Eigen::Vector2d(left + kSide_px, top + kSide_px), Eigen::Vector2d(left, top + kSide_px)};
  frame.detections.push_back(seen);
  return frame;
}

/// The square moves to the right during the exposure; `gamma` is applied as in a camera.
Image smeared_image(double left, double top, double smear_px, double sigma_px, double gamma, Random& random) {
  constexpr int kMoments = 24;
  const double sigma = std::hypot(sigma_px, std::sqrt(1.0 / 12));  // approximates the pixel area
  Image image(kImageWidth, kImageHeight);
  std::vector<double> dark(kImageWidth, 0.0);
  for (int x = 0; x < kImageWidth; ++x)
    for (int i = 0; i < kMoments; ++i)
      dark[static_cast<std::size_t>(x)] +=
          shadow(x + 0.5, left + smear_px * ((i + 0.5) / kMoments - 0.5), sigma) / kMoments;
  for (int y = 0; y < kImageHeight; ++y) {
    const double vertical = shadow(y + 0.5, top, sigma);
    for (int x = 0; x < kImageWidth; ++x) {
      const double light = 1 - 0.9 * dark[static_cast<std::size_t>(x)] * vertical;
      image.row(y)[x] =
          static_cast<std::uint8_t>(std::lround(210 * std::pow(light, 1 / gamma) + 2 * random.normal()));
    }
  }
  return image;
}

std::optional<BlurFit> fit_of(double exposure_s, double sigma_px, double gamma, double fastest_px_s) {
  Random random(5);
  std::vector<EdgeBlur> edges;
  constexpr double kPeriod_s = 1.0 / 15;
  for (int i = 0; i < 60; ++i) {
    const double speed = fastest_px_s * i / 60;
    const double left = 100 + random.uniform();
    const double top = 60 + random.uniform();
    const Image image = smeared_image(left, top, speed * exposure_s, sigma_px, gamma, random);
    const auto some =
        edge_blurs(image, frame_at(left - speed * kPeriod_s, top, 1 - kPeriod_s), frame_at(left, top, 1),
                   frame_at(left + speed * kPeriod_s, top, 1 + kPeriod_s));
    edges.insert(edges.end(), some.begin(), some.end());
  }
  return fit_exposure(std::move(edges));
}

TEST(MotionBlur, EstimatesExposureAndLensBlurInLinearImages) {
  const auto fit = fit_of(0.010, 0.6, 1, 400);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->exposure_s, 0.010, 0.0005);
  EXPECT_NEAR(fit->still_sigma_px, 0.6, 0.08);
}

TEST(MotionBlur, GammaHasASmallEffectOnTheExposure) {
  const auto fit = fit_of(0.010, 0.6, 2.2, 400);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->exposure_s, 0.010, 0.001);
}

TEST(MotionBlur, SkipsSaturatedEdges) {
  Random random(5);
  Image image = smeared_image(100, 60, 0, 0.6, 1, random);
  for (int y = 0; y < kImageHeight; ++y)
    for (int x = 0; x < kImageWidth; ++x)
      image.row(y)[x] = static_cast<std::uint8_t>(std::min(255, 2 * image.row(y)[x]));
  EXPECT_TRUE(
      edge_blurs(image, frame_at(100, 60, 0.9), frame_at(100, 60, 1), frame_at(100, 60, 1.1)).empty());
}

TEST(MotionBlur, NoEstimateForSlowMotion) {
  EXPECT_FALSE(fit_of(0.010, 0.6, 1, 15));
  EXPECT_FALSE(fit_of(0, 0.6, 1, 400)) << "no motion blur without exposure time";
  EXPECT_FALSE(fit_exposure({}));
}

TEST(MotionBlur, SkipsEdgesWithoutNeighboursContrastOrSpace) {
  Random random(5);
  const TagFrame here = frame_at(100, 60, 1);
  const Image image = smeared_image(100, 60, 0, 0.6, 1, random);
  EXPECT_EQ(edge_blurs(image, frame_at(100, 60, 0.9), here, frame_at(100, 60, 1.1)).size(), 4U);
  EXPECT_TRUE(edge_blurs(image, {}, here, frame_at(100, 60, 1.1)).empty());
  EXPECT_TRUE(
      edge_blurs(Image(kImageWidth, kImageHeight, 128), frame_at(100, 60, 0.9), here, frame_at(100, 60, 1.1))
          .empty());
  EXPECT_TRUE(edge_blurs({}, frame_at(100, 60, 0.9), here, frame_at(100, 60, 1.1)).empty());
  const TagFrame border = frame_at(2, 60, 1);
  EXPECT_TRUE(edge_blurs(image, frame_at(2, 60, 0.9), border, frame_at(2, 60, 1.1)).empty());
}

}  // namespace
}  // namespace waymark
