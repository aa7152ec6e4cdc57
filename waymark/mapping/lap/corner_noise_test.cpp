// The corner noise of a lap from what is left over: right also where the fit uses up half of every
// observation.
#include "waymark/mapping/lap/corner_noise.hpp"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr double kSize_m = 0.16;
constexpr double kClaimed_px = 0.1;

CameraModel lens() {
  return CameraModel::make(PinholeRadtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 4}, 640,
                           480)
      .value();
}

/// A camera that walks past a wall of tags; it sees the nearest ones only, two at a time. All at the truth.
LapBundle walk(int frames) {
  constexpr int kTags = 10;
  LapBundle lap;
  Bundle& bundle = lap.bundle;
  bundle.cameras = {lens()};
  lap.map = bundle.add({}, true);
  lap.cam = bundle.add({}, true);
  for (int i = 0; i < kTags; ++i) {
    const SE3 map_T_tag(SO3::exp({0.4, 0.3 * (i % 3), 0}), Eigen::Vector3d(0.5 * i, 0.1 * (i % 2), 1.6));
    lap.tags[{FamilyId::Tag36h11, i}] = bundle.add(map_T_tag, i == 0);
  }
  for (int f = 0; f < frames; ++f) {
    const double along = (kTags - 1.01) * f / frames;
    const PoseIndex base = bundle.add(SE3(SO3::exp({0, 0.05, 0.02}), Eigen::Vector3d(0.5 * along, 0, 0)));
    lap.bases.emplace_back(base);
    for (const int number : {static_cast<int>(along), static_cast<int>(along) + 1}) {
      const PoseIndex tag = lap.tags.at({FamilyId::Tag36h11, number});
      const auto corners = visible_corners(
          bundle.cameras[0], bundle.poses[base].value.inverse() * bundle.poses[tag].value, kSize_m);
      if (!corners) continue;
      TagDetection seen;
      seen.corners_px = *corners;
      const CornerFactor factor = corner_factor(seen, kSize_m, kClaimed_px).value();
      bundle.corners.push_back({base, lap.cam, lap.map, tag, 0, factor});
    }
  }
  return lap;
}

void add_noise(Bundle& bundle, double sigma_px, Random& random) {
  for (CornerTerm& term : bundle.corners) {
    for (auto& corner : term.factor.corners_px)
      corner += sigma_px * Eigen::Vector2d(random.normal(), random.normal());
  }
}

TEST(CornerNoise, WhatTheFitUsesUpAreItsUnknowns) {
  const LapBundle lap = walk(60);
  ASSERT_EQ(lap.bundle.corners.size(), 120U);
  const std::vector<double> freedom = internal::freedom_left(lap);
  const double left = std::accumulate(freedom.begin(), freedom.end(), 0.0);
  EXPECT_NEAR(left, 8.0 * 120 - 6 * (60 + 9), 1e-2);
}

TEST(CornerNoise, IsFoundWhereMuchOfItIsFitted) {
  constexpr int kDraws = 20;
  constexpr double kTrue = 1.7;
  Random random(11);
  double mean = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    LapBundle lap = walk(100);
    add_noise(lap.bundle, kTrue * kClaimed_px, random);
    ASSERT_TRUE(solve(lap.bundle).usable());
    mean += internal::noise_ratio(corner_chi2(lap.bundle), internal::freedom_left(lap)) / kDraws;
  }
  EXPECT_NEAR(mean, kTrue, 0.02 * kTrue);
}

TEST(CornerNoise, OutliersHardlyMoveIt) {
  LapBundle lap = walk(100);
  Random random(12);
  add_noise(lap.bundle, kClaimed_px, random);
  ASSERT_TRUE(solve(lap.bundle).usable());
  std::vector<double> chi2 = corner_chi2(lap.bundle);
  const std::vector<double> freedom = internal::freedom_left(lap);
  const double before = internal::noise_ratio(chi2, freedom);
  for (std::size_t i = 0; i < chi2.size(); i += 20) chi2[i] = 1e4;
  chi2[1] = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(internal::noise_ratio(chi2, freedom), before, 0.1 * before);
}

TEST(CornerNoise, TooFewObservationsTellNothing) {
  EXPECT_EQ(internal::noise_ratio(std::vector<double>(49, 30.0), std::vector<double>(49, 6.0)), 1);
  EXPECT_EQ(internal::noise_ratio(std::vector<double>(99, 0.1), std::vector<double>(99, 1.0)), 1)
      << "one tag in each frame";
}

}  // namespace
}  // namespace waymark
