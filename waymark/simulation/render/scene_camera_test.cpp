#include "waymark/simulation/render/scene_camera.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/simulation/render/scene_exposure.hpp"

/// Compares the effects of optics and sensor on an image with formulas.
namespace waymark {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr double kFocal = 400;

CameraModel pinhole() {
  return CameraModel::make(PinholeRadtan{.fx = kFocal, .fy = kFocal, .cx = 160, .cy = 120}, kWidth, kHeight)
      .value();
}

/// Only radiance and pixels, without other effects; white is 200 and black is 0.
SceneCameraOptions bare() {
  return {
      .exposure_ms = 0, .lens_sigma_px = 0, .white_level_dn = 200, .full_well_electrons = 0, .ambient = 1};
}

Scene even_radiance(double reflectance) { return {.surfaces = {}, .sky_reflectance = reflectance}; }

constexpr double kSlant = 0.05;  ///< slope of the edge; rows cross it at all subpixel positions (ISO 12233)
/// The right half of the world is white, so there is an edge through the optical axis at this distance.
Scene edge_at(double distance_m) {
  const double side = 4 * distance_m;
  const double turn = -std::atan(kSlant);
  const SE3 pose(SO3::from_rpy(0, 0, turn),
                 {side / 2 * std::cos(turn), side / 2 * std::sin(turn), distance_m});
  return {.surfaces = {plain_surface(pose, side, side, {.reflectance = 1})}, .sky_reflectance = 0};
}

const CameraMotion kStill = [](double) { return SE3(); };
/// The camera rotates to the right about its y axis.
CameraMotion pan(double rad_s) {
  return [=](double t) { return SE3(SO3::exp({0, rad_s * t, 0}), Vector3d::Zero()); };
}

std::vector<float> radiance_of(const Scene& scene, const SceneCameraOptions& options,
                               const CameraMotion& motion = kStill) {
  const auto camera = SceneCamera::make(scene, pinhole(), options).value();
  const auto exposure = camera.begin(motion, SensorTime(), 1).value();
  for (int band = 0; band < camera.bands(); ++band) camera.expose(*exposure, band);
  return exposure->radiance;
}

Image take(const Scene& scene, const SceneCameraOptions& options, double stamp_s = 0,
           std::uint64_t seed = 1) {
  const SensorTime stamp{Duration(std::llround(stamp_s * 1e9))};
  return SceneCamera::make(scene, pinhole(), options).value().render(kStill, stamp, seed).value().image;
}

/// Position of the edge from edge_at() in the row through the axis, and the variance of its blur. Both are
/// moments of the differences between neighbouring pixels, averaged over rows. Sampling by pixels distributes
/// every point between two of them and thus adds f (1 - f) to the variance, where f is the position within
/// the pixel: 1/6 on average.
struct EdgeMoments {
  double mean = 0;
  double variance = 0;
};
EdgeMoments row_moments(const std::vector<float>& radiance, int y) {
  const float* row = radiance.data() + static_cast<std::ptrdiff_t>(y) * kWidth;
  EdgeMoments moments;
  for (int x = 1; x < kWidth; ++x) moments.mean += static_cast<double>(row[x] - row[x - 1]) * x;
  for (int x = 1; x < kWidth; ++x)
    moments.variance += static_cast<double>(row[x] - row[x - 1]) * std::pow(x - moments.mean, 2);
  return moments;
}
EdgeMoments edge_moments(const std::vector<float>& radiance) {
  constexpr int kRows = 200;  // equivalent to ten pixels along the slanted edge
  EdgeMoments mean;
  for (int y = (kHeight - kRows) / 2; y < (kHeight + kRows) / 2; ++y) {
    const EdgeMoments row = row_moments(radiance, y);
    mean.mean += (row.mean - kSlant * (y + 0.5 - kHeight / 2.0)) / kRows;
    mean.variance += (row.variance - 1.0 / 6 - kSlant * kSlant / 12) / kRows;
  }
  return mean;
}

TEST(SceneCamera, MotionBlurIsAsWideAsRateTimesExposureTimesFocalLength) {
  SceneCameraOptions options = bare();
  for (const double blur_px : {1.0, 3.0, 8.0, 20.0}) {
    options.exposure_ms = 10;
    const double rate = blur_px / (kFocal * 0.010);
    const EdgeMoments moments = edge_moments(radiance_of(edge_at(2), options, pan(rate)));
    const double width = std::sqrt(12 * (moments.variance));  // of a uniform distribution with this variance
    EXPECT_NEAR(width, blur_px, 0.01 * blur_px);
    EXPECT_NEAR(moments.mean, 160, 0.005);  // the stamp is the middle of the exposure
  }
}

TEST(SceneCamera, LateralMotionBlursByParallax) {
  SceneCameraOptions options = bare();
  options.exposure_ms = 20;
  const double speed = 0.5;
  const CameraMotion motion = [=](double t) { return SE3(SO3(), {speed * t, 0, 0}); };
  for (const double distance : {0.5, 2.0}) {
    const EdgeMoments moments = edge_moments(radiance_of(edge_at(distance), options, motion));
    const double expected = kFocal * speed * 0.020 / distance;
    EXPECT_NEAR(std::sqrt(12 * (moments.variance)), expected, 0.01 * expected);
  }
}

TEST(SceneCamera, AccelerationWithinTheExposureIsIntegrated) {
  SceneCameraOptions options = bare();
  options.exposure_ms = 10;
  options.blur_step_px = 0.1;
  const double jerk =
      10 / kFocal / (0.005 * 0.005);  // [rad/s2]: rotated by 10 px at either end, 0 in the middle
  const CameraMotion motion = [=](double t) { return SE3(SO3::exp({0, jerk * t * t, 0}), Vector3d::Zero()); };
  const EdgeMoments moments = edge_moments(radiance_of(edge_at(2), options, motion));
  EXPECT_NEAR(moments.mean, 160 - 10.0 / 3,
              0.05);  // the mean of t squared is a third of its value at the ends
}

TEST(SceneCamera, RollingShutterSlantsAnEdgeByRateTimesReadout) {
  SceneCameraOptions options = bare();
  options.readout_ms = 20;
  const double rate = 1.5;
  const std::vector<float> radiance = radiance_of(edge_at(2), options, pan(rate));
  const double top = row_moments(radiance, 10).mean;
  const double bottom = row_moments(radiance, kHeight - 11).mean;
  // the camera rotates to the right, so the edge moves left
  const double per_row = kFocal * rate * 0.020 / kHeight;
  EXPECT_NEAR((bottom - top) / (kHeight - 21), kSlant - per_row, 0.005 * per_row);
  EXPECT_NEAR(edge_moments(radiance).mean, 160, 0.002);
}

TEST(SceneCamera, DefocusIsTheDiscOfAThinLens) {
  SceneCameraOptions options = bare();
  options.aperture_mm = 10;
  options.focus_distance_m = 1;
  for (const double distance : {0.4, 0.6, 1.0, 2.0, 5.0}) {
    const EdgeMoments moments = edge_moments(radiance_of(edge_at(distance), options));
    const double disc = kFocal * 0.010 * std::abs(1 / distance - 1);  // diameter [px]
    // The variance of a disc along a line is diameter^2 / 16.
    EXPECT_NEAR(4 * std::sqrt(std::max(0.0, moments.variance)), disc, 0.02 * disc + 0.02) << distance;
    EXPECT_NEAR(moments.mean, 160, 0.02);
  }
}

TEST(SceneCamera, TheLensBlursAnEdgeByItsSigma) {
  for (const double sigma : {0.3, 0.5, 0.8, 1.6}) {
    SceneCameraOptions options = bare();
    options.lens_sigma_px = sigma;
    const Image image = take(edge_at(2), options);
    std::vector<float> radiance(image.row(0), image.row(0) + static_cast<std::ptrdiff_t>(kWidth) * kHeight);
    for (float& value : radiance) value /= 200;
    const EdgeMoments moments = edge_moments(radiance);
    EXPECT_NEAR(moments.variance, sigma * sigma, 0.02 * sigma * sigma + 0.004);  // the last term is rounding
  }
}

TEST(SceneCamera, VignettingIsTheFourthPowerOfTheCosine) {
  SceneCameraOptions options = bare();
  options.vignetting_power = 4;
  const Image image = take(even_radiance(1), options);
  for (const auto& [x, y] : {std::pair{160, 120}, {0, 0}, {319, 120}, {40, 230}}) {
    const double cosine =
        kFocal / std::sqrt(kFocal * kFocal + std::pow(x + 0.5 - 160, 2) + std::pow(y + 0.5 - 120, 2));
    EXPECT_NEAR(image.row(y)[x], 200 * std::pow(cosine, 4), 0.51);
  }
}

TEST(SceneCamera, GammaIsAPower) {
  SceneCameraOptions options = bare();
  options.gamma = 2.2;
  for (const double reflectance : {0.02, 0.1, 0.5, 0.9}) {
    const double expected = 255 * std::pow(reflectance * 200 / 255, 1 / 2.2);
    EXPECT_NEAR(take(even_radiance(reflectance), options).row(7)[9], expected, 0.75);
  }
}

TEST(SceneCamera, NoiseHasTheVarianceOfItsElectrons) {
  SceneCameraOptions options = bare();
  options.full_well_electrons = 4000;
  options.read_noise_electrons = 25;
  const double gain = 255.0 / 4000;  // grey levels per electron
  for (const double reflectance : {0.1, 0.4, 0.7, 1.0}) {
    const Image image = take(even_radiance(reflectance), options);
    const double electrons = reflectance * 200 / gain;
    double sum = 0;
    double squares = 0;
    const double count = double{kWidth} * kHeight;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        sum += image.row(y)[x];
        squares += std::pow(image.row(y)[x] - 200 * reflectance, 2);
      }
    }
    const double variance = gain * gain * (electrons + 25 * 25) + 1.0 / 12;  // photons, read noise, rounding
    EXPECT_NEAR(sum / count, 200 * reflectance, 4 * std::sqrt(variance / count));
    EXPECT_NEAR(squares / count, variance, 4 * variance * std::sqrt(2 / count));
  }
}

TEST(SceneCamera, NoiseOfNeighboursRowsAndFramesIsUncorrelated) {
  SceneCameraOptions options = bare();
  options.full_well_electrons = 1000;
  const Image one = take(even_radiance(0.6), options, 0, 1);
  const Image two = take(even_radiance(0.6), options, 0, 2);
  double right = 0, below = 0, later = 0, own = 0;
  for (int y = 0; y + 1 < kHeight; ++y) {
    for (int x = 0; x + 1 < kWidth; ++x) {
      const double here = one.row(y)[x] - 120.0;
      own += here * here;
      right += here * (one.row(y)[x + 1] - 120.0);
      below += here * (one.row(y + 1)[x] - 120.0);
      later += here * (two.row(y)[x] - 120.0);
    }
  }
  const double chance = 4 / std::sqrt(double{kWidth} * kHeight);
  EXPECT_LT(std::abs(right / own), chance);
  EXPECT_LT(std::abs(below / own), chance);
  EXPECT_LT(std::abs(later / own), chance);
}

TEST(SceneCamera, FlickerIsAveragedOverTheExposure) {
  SceneCameraOptions options = bare();
  options.flicker = 0.3;
  options.flicker_hz = 100;
  EXPECT_NEAR(take(even_radiance(0.5), options, 0.0025).row(0)[0], 130, 0.51);  // a quarter of a period
  EXPECT_NEAR(take(even_radiance(0.5), options, 0.0075).row(0)[0], 70, 0.51);
  options.exposure_ms = 5;  // over half a period, 2 / pi of the amplitude remains
  EXPECT_NEAR(take(even_radiance(0.5), options, 0.0025).row(0)[0], 100 * (1 + 0.3 * 2 / std::numbers::pi),
              0.51);
  options.exposure_ms = 10;  // whole periods cancel out
  EXPECT_NEAR(take(even_radiance(0.5), options, 0.0025).row(0)[0], 100, 0.51);
  options.exposure_ms = 0;
  options.readout_ms = 10;  // rows are exposed at different times, which causes bands
  const Image bands = take(even_radiance(0.5), options);
  EXPECT_NEAR(bands.row(kHeight * 3 / 4)[5], 130, 0.6);
  EXPECT_NEAR(bands.row(kHeight / 4)[5], 70, 0.6);
  options = bare();
  options.drift = 0.2;
  options.drift_period_s = 40;
  EXPECT_NEAR(take(even_radiance(0.5), options, 10).row(0)[0], 120, 0.51);
}

}  // namespace
}  // namespace waymark
