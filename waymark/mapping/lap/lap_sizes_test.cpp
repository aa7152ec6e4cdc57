// Printed sizes of tags that deviate from their given ones, in laps on a ring. A wrong size is given for a
// tag, instead of printing it in another one.
#include "waymark/mapping/lap/lap_sizes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/ring_drive.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/lap/map_checks.hpp"
#include "waymark/mapping/lap/tag_ties.hpp"

namespace waymark {
namespace {

using test::drive_ring;
using test::ring_tag;
using test::RingDrive;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kOdometry_m = 5e-4;
constexpr double kOdometry_rad = 1e-3;

RingDrive noisy(std::uint64_t seed) {
  return drive_ring({.loops = 2.1,
                     .stated_sigma_px = 0.2,
                     .noise_px = 0.2,
                     .odometry_sigma_m = kOdometry_m,
                     .odometry_sigma_rad = kOdometry_rad,
                     .seed = seed});
}

BundleMap mapped(const LapInput& lap, double sigma_percent = SearchOptions().tag_size_sigma_percent) {
  BundleMapOptions options;
  options.search.tag_size_sigma_percent = sigma_percent;
  options.model = {.odometry_sigma_m = kOdometry_m,
                   .odometry_sigma_m_per_sqrt_m = 0,
                   .odometry_sigma_rad = kOdometry_rad,
                   .odometry_sigma_rad_per_sqrt_m = 0,
                   .odometry_sigma_rad_per_sqrt_rad = 0};
  auto map = map_by_bundle(lap, {}, options);
  EXPECT_TRUE(map) << to_string(map.error());
  return map ? std::move(*map) : BundleMap();
}

double rmse_m(const RingDrive& drive, const BundleMap& map) {
  double sum = 0;
  for (const auto& [id, tag] : map.map.tags)
    sum += (tag.map_T_tag.translation() - drive.tags.tags.at(id).map_T_tag.translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(map.map.tags.size()));
}

/// The side that observations fit if the given one is `factor` times too small.
void print_larger(double factor, const TagId& tag, LapInput& lap) {
  lap.sizes.size_by_tag_m[tag] = *lap.sizes.default_size_m / factor;
}

TEST(LapSizes, AWrongAnchorSizeIsFoundAndTheMapIsThatOfTheCorrectSize) {
  for (const double factor : {1.05, 0.9}) {
    RingDrive drive = noisy(21);
    const BundleMap correct = mapped(drive.lap);
    print_larger(factor, drive.lap.anchor, drive.lap);
    const BundleMap map = mapped(drive.lap);
    ASSERT_EQ(map.wrong_sizes.size(), 1U) << factor;
    EXPECT_EQ(map.wrong_sizes[0].tag, drive.lap.anchor);
    EXPECT_NEAR(map.wrong_sizes[0].found_m, 0.16, std::max(0.003 * 0.16, 3 * map.wrong_sizes[0].sigma_m))
        << factor;
    EXPECT_EQ(map.map.tags.at(drive.lap.anchor).size_m, map.wrong_sizes[0].found_m);
    EXPECT_LT(rmse_m(drive, map), rmse_m(drive, correct) + 0.005) << factor;
    EXPECT_GT(rmse_m(drive, mapped(drive.lap, 0)), 3 * rmse_m(drive, map)) << factor;
  }
}

TEST(LapSizes, AnotherWrongSizeIsFoundAndNoOtherTagIsReported) {
  for (const double factor : {1.1, 0.95}) {
    RingDrive drive = noisy(22);
    const BundleMap correct = mapped(drive.lap);
    print_larger(factor, ring_tag(5), drive.lap);
    const BundleMap map = mapped(drive.lap);
    ASSERT_EQ(map.wrong_sizes.size(), 1U) << factor;
    EXPECT_EQ(map.wrong_sizes[0].tag, ring_tag(5));
    EXPECT_NEAR(map.wrong_sizes[0].found_m, 0.16, std::max(0.003 * 0.16, 3 * map.wrong_sizes[0].sigma_m))
        << factor;
    EXPECT_LT((map.map.tags.at(ring_tag(5)).map_T_tag.translation() -
               correct.map.tags.at(ring_tag(5)).map_T_tag.translation())
                  .norm(),
              0.01);
    LapInput found = drive.lap;
    found.sizes = found_sizes(drive.lap.sizes, map);
    const std::vector<std::string> warnings = check_map(found, map);
    ASSERT_FALSE(warnings.empty());
    EXPECT_THAT(warnings[0], HasSubstr("tag36h11:5: its observations fit a side of"));
    for (int number = 0; number < 12; ++number) {
      if (number != 5) {
        EXPECT_THAT(warnings, Each(Not(HasSubstr(to_string(ring_tag(number)) + " "))));
        EXPECT_THAT(warnings, Each(Not(HasSubstr(to_string(ring_tag(number)) + ":"))));
      }
    }
  }
}

TEST(LapSizes, CorrectSizesAreNotReported) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const RingDrive drive = noisy(seed);
    const BundleMap map = mapped(drive.lap);
    const BundleMap exact = mapped(drive.lap, 0);
    EXPECT_TRUE(map.wrong_sizes.empty()) << seed;
    EXPECT_LT(map.size_spread, 0.0035) << seed;
    EXPECT_THAT(check_map(drive.lap, map), Each(Not(HasSubstr("size")))) << seed;
    double ratio = 0;
    for (const auto& [id, tag] : map.map.tags) {
      if (id == drive.lap.anchor) continue;
      ratio += std::sqrt(tag.covariance->trace() / exact.map.tags.at(id).covariance->trace()) / 11;
    }
    EXPECT_LT(ratio, 1.3) << seed;
    EXPECT_GT(ratio, 0.99) << seed;
  }
}

/// Normalised squared error of all tag poses together per dimension (1 if the covariance is consistent). The
/// joint covariance is that of the ties between tags.
double joint_nees(const RingDrive& drive, const BundleMap& map) {
  const auto error = [&](const TagId& id) -> Vector6 {
    return minus(drive.tags.tags.at(id).map_T_tag, map.map.tags.at(id).map_T_tag);
  };
  double sum = 0;
  int count = 0;
  for (const auto& [id, tag] : map.map.tags) {
    if (!tag.tie) continue;
    const internal::TiedError given_other = internal::tied_error(tag, map.map.tags.at(tag.tie->to));
    const Vector6 e = error(id) - given_other.gain * error(tag.tie->to);
    sum += e.dot(given_other.covariance.llt().solve(e));
    count += 6;
  }
  EXPECT_GE(count, 60);
  return sum / count;
}

TEST(LapSizes, TheCovarianceIsConsistentWithTheSpreadOfSizes) {
  constexpr double kAssumed = 0.003;
  for (const double spread : {kAssumed, 0.01}) {
    double exact = 0;
    double nees = 0;
    double found = 0;
    constexpr int kSeeds = 10;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      RingDrive drive = noisy(seed);
      Random random(100 + seed);
      for (int number = 0; number < 12; ++number)
        print_larger(std::exp(spread * random.normal()), ring_tag(number), drive.lap);
      const BundleMap map = mapped(drive.lap);
      for (const WrongSize& wrong : map.wrong_sizes)
        EXPECT_NEAR(wrong.found_m, 0.16, 4 * wrong.sigma_m) << spread << " " << seed;
      if (spread == kAssumed) {
        EXPECT_TRUE(map.wrong_sizes.empty()) << seed;
      }
      nees += joint_nees(drive, map) / kSeeds;
      exact += joint_nees(drive, mapped(drive.lap, 0)) / kSeeds;
      found += map.size_spread / kSeeds;
    }
    std::printf("sizes %.1f %% off: joint NEES %.2f of 1 (%.1f if sizes are exact)\n", 100 * spread, nees,
                exact);
    EXPECT_GT(nees, 0.8) << spread;
    EXPECT_LT(nees, 1.3) << spread;
    EXPECT_GT(exact, 2) << spread;
    EXPECT_NEAR(found, spread, 0.4 * spread);
  }
}

TEST(LapSizes, ACommonErrorChangesTheOdometryScaleAndNoSize) {
  RingDrive drive = noisy(23);
  drive.lap.sizes.default_size_m = *drive.lap.sizes.default_size_m / 1.05;
  const BundleMap map = mapped(drive.lap);
  EXPECT_NEAR(map.odometry_scales.distance, 1 / 1.05, 0.003);
  EXPECT_TRUE(map.wrong_sizes.empty());
  EXPECT_LT(map.size_spread, 0.0035);
}

TEST(LapSizes, TheScaleIsThatOfTheMeanSize) {
  // Odometry scales are unknown, so that the sizes alone determine the scale: the error of its logarithm is
  // the mean of all errors of sizes, and smaller than the error of the anchor.
  double squares = 0;
  constexpr int kSeeds = 12;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    RingDrive drive = noisy(seed);
    Random random(200 + seed);
    double mean = 0;
    for (int number = 0; number < 12; ++number) {
      const double off = 0.003 * random.normal();
      mean += off / 12;
      print_larger(std::exp(off), ring_tag(number), drive.lap);
    }
    const BundleMap map = mapped(drive.lap);
    const double sigma = map.odometry_scales_sigma.distance;
    EXPECT_NEAR(std::log(map.odometry_scales.distance), -mean, 4 * sigma) << seed;
    EXPECT_GT(sigma, 0.5 * 0.003 / std::sqrt(12)) << seed;
    EXPECT_LT(sigma, 3 * 0.003 / std::sqrt(12)) << seed;
    squares += std::pow(std::log(map.odometry_scales.distance) / sigma, 2) / kSeeds;
  }
  EXPECT_GT(squares, 0.3);
  EXPECT_LT(squares, 2.2);
}

TEST(LapSizes, AMovedTagHasNoWrongSize) {
  RingDrive drive = noisy(24);
  // In the second loop, tag 7 is 0.1 m beside its earlier place.
  const SE3 aside({}, {0.1, 0, 0});
  const std::size_t second = drive.lap.frames.size() / 2;
  for (std::size_t f = second; f < drive.lap.frames.size(); ++f) {
    const SE3 cam_T_map = (drive.truth[f].map_T_base * drive.lap.base_T_cam).inverse();
    for (TagDetection& seen : drive.lap.frames[f].detections) {
      if (seen.tag != ring_tag(7)) continue;
      const SE3 map_T_tag = drive.tags.tags.at(seen.tag).map_T_tag * aside;
      if (const auto corners = visible_corners(drive.lap.camera, cam_T_map * map_T_tag, 0.16))
        seen.corners_px = *corners;
    }
  }
  const BundleMap map = mapped(drive.lap);
  const BundleMap exact = mapped(drive.lap, 0);
  EXPECT_TRUE(map.wrong_sizes.empty());
  EXPECT_LT(rmse_m(drive, map), rmse_m(drive, exact) + 0.01);
}

}  // namespace
}  // namespace waymark
