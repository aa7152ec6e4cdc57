// Tags whose observations contradict the map, in laps on a ring: printed sizes that deviate from their given
// ones, and tags that were moved between two loops. A wrong size is given for a tag, instead of printing it
// in another one.
#include "waymark/mapping/lap/lap_contradictions.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/ring_drive.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/lap/map_checks.hpp"
#include "waymark/mapping/lap/tag_ties.hpp"

namespace waymark {
namespace {

using test::drive_ring;
using test::ring_tag;
using test::RingDrive;
using ::testing::Contains;
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

BundleMap mapped(const LapInput& lap, double sigma_percent = SearchOptions().tag_size_sigma_percent,
                 double common_sigma_percent = 0) {
  BundleMapOptions options;
  options.search.tag_size_sigma_percent = sigma_percent;
  options.search.common_tag_size_sigma_percent = common_sigma_percent;
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

TEST(LapSizes, AnErrorThatAllSizesShareIsInTheCovariances) {
  constexpr double kLarger = 1.02;
  for (const double own_percent : {0.3, 0.0}) {
    double nees = 0;
    double exact = 0;
    constexpr int kSeeds = 5;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      RingDrive drive = noisy(seed);
      *drive.lap.sizes.default_size_m /= kLarger;
      const BundleMap map = mapped(drive.lap, own_percent, 2);
      EXPECT_LT(map.size_scale_sigma, 0.0201 * map.size_scale) << seed;
      EXPECT_NEAR(map.size_scale, kLarger, 3 * map.size_scale_sigma) << seed;
      EXPECT_TRUE(map.wrong_sizes.empty()) << seed;
      const double side_m = *drive.lap.sizes.default_size_m * map.size_scale;
      EXPECT_NEAR(map.map.tags.at(ring_tag(5)).size_m, side_m, 1e-12);
      EXPECT_NEAR(*found_sizes(drive.lap.sizes, map).default_size_m, side_m, 1e-12);
      nees += joint_nees(drive, map) / kSeeds;
      exact += joint_nees(drive, mapped(drive.lap, own_percent)) / kSeeds;
    }
    std::printf("all sizes 2 %% off: joint NEES %.2f of 1 (%.1f without a common error)\n", nees, exact);
    EXPECT_GT(nees, 0.7) << own_percent;
    EXPECT_LT(nees, 1.4) << own_percent;
    EXPECT_GT(exact, nees) << own_percent;
  }
}

TEST(LapSizes, AnExtendedMapDeterminesTheErrorThatAllSizesShare) {
  constexpr double kLarger = 1.02;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RingDrive drive = noisy(seed);
    *drive.lap.sizes.default_size_m /= kLarger;
    drive.lap.prior = LapPrior{.map = drive.tags};
    for (auto& [id, tag] : drive.lap.prior->map.tags) tag.covariance = Matrix6(1e-5 * Matrix6::Identity());
    const BundleMap map = mapped(drive.lap, 0.3, 2);
    EXPECT_EQ(map.prior_agreeing, 12) << seed;
    EXPECT_LT(map.size_scale_sigma, 0.002) << seed;
    EXPECT_NEAR(map.size_scale, kLarger, 3 * map.size_scale_sigma) << seed;
    EXPECT_LT(rmse_m(drive, map), 0.01) << seed;
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

/// Two loops of the ring. Between them, all tags are out of view for some time.
test::RingShape two_loops(std::uint64_t seed) {
  return {.loops = 2,
          .stated_sigma_px = 0.2,
          .noise_px = 0.2,
          .odometry_sigma_m = kOdometry_m,
          .odometry_sigma_rad = kOdometry_rad,
          .seed = seed};
}

/// The frame in the middle of the longest time without an observation of a tag.
std::size_t between_passes(const RingDrive& drive, int number) {
  std::size_t last = 0;
  std::size_t middle = 0;
  std::size_t longest = 0;
  for (std::size_t f = 0; f < drive.lap.frames.size(); ++f) {
    if (std::ranges::count(drive.lap.frames[f].detections, ring_tag(number), &TagDetection::tag) == 0)
      continue;
    if (last > 0 && f - last > longest) {
      longest = f - last;
      middle = (f + last) / 2;
    }
    last = f;
  }
  return middle;
}

double error_m(const RingDrive& drive, const BundleMap& map, int number) {
  return (map.map.tags.at(ring_tag(number)).map_T_tag.translation() -
          drive.tags.tags.at(ring_tag(number)).map_T_tag.translation())
      .norm();
}

double sigma_m(const BundleMap& map, int number) {
  const MappedTag& tag = map.map.tags.at(ring_tag(number));
  return std::sqrt(
      coordinate_covariance(Uncertain<SE3>{tag.map_T_tag, *tag.covariance}).diagonal().head<3>().sum());
}

TEST(LapMoves, AMovedTagIsFoundAndItsLastPoseIsInTheMap) {
  for (const auto& [number, distance_m] :
       {std::pair(7, 0.03), {7, 0.05}, {7, 0.2}, {4, 0.03}, {9, 0.03}, {10, 0.6}}) {
    for (std::uint64_t seed = 41; seed <= 42; ++seed) {
      SCOPED_TRACE(::testing::Message() << "tag " << number << ", " << distance_m << " m, seed " << seed);
      const test::RingShape shape = two_loops(seed);
      RingDrive drive = drive_ring(shape);
      const std::size_t frame = between_passes(drive, number);
      test::move_tag(drive, shape, number, SE3({}, {0.8 * distance_m, -0.6 * distance_m, 0}), frame);
      const BundleMap map = mapped(drive.lap);
      ASSERT_EQ(map.moved_tags.size(), 1U);
      EXPECT_EQ(map.moved_tags[0].tag, ring_tag(number));
      EXPECT_NEAR(map.moved_tags[0].distance_m, distance_m, 0.01);
      const double frame_s = to_seconds(drive.lap.frames[frame].stamp - drive.lap.frames[0].stamp);
      EXPECT_LT(map.moved_tags[0].last_before_s, frame_s);
      EXPECT_GE(map.moved_tags[0].first_after_s, frame_s);
      EXPECT_TRUE(map.wrong_sizes.empty());
      EXPECT_TRUE(map.missing_tags.empty());
      EXPECT_EQ(map.map.tags.size(), 12U);
      for (int other = 0; other < 12; ++other)
        EXPECT_LT(error_m(drive, map, other), std::max(0.01, 3 * sigma_m(map, other))) << other;
      const std::vector<std::string> warnings = check_map(drive.lap, map);
      EXPECT_THAT(warnings, Contains(HasSubstr(to_string(ring_tag(number)) + ": moved by")));
      EXPECT_THAT(warnings, Not(Contains(HasSubstr("two places"))));
    }
  }
}

/// What is given about the anchor applies to the time before the move.
TEST(LapMoves, TheFrameIsThatOfTheAnchorBeforeItWasMoved) {
  for (const double distance_m : {0.05, 0.2}) {
    const test::RingShape shape = two_loops(43);
    RingDrive drive = drive_ring(shape);
    test::move_tag(drive, shape, 0, SE3(SO3::exp({0, 0, 0.1}), {distance_m, 0, 0}), between_passes(drive, 0));
    const BundleMap map = mapped(drive.lap);
    ASSERT_EQ(map.moved_tags.size(), 1U) << distance_m;
    EXPECT_EQ(map.moved_tags[0].tag, ring_tag(0));
    for (int number = 0; number < 12; ++number)
      EXPECT_LT(error_m(drive, map, number), std::max(0.01, 3 * sigma_m(map, number))) << number;
  }
}

TEST(LapMoves, ATagThatWasNotMovedIsNotReported) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    RingDrive drive = drive_ring(two_loops(seed));
    if (seed > 3) print_larger(1.05, ring_tag(5), drive.lap);
    const BundleMap map = mapped(drive.lap);
    EXPECT_TRUE(map.moved_tags.empty()) << seed;
    EXPECT_EQ(map.wrong_sizes.size(), seed > 3 ? 1U : 0U) << seed;
    EXPECT_TRUE(mapped(drive_ring(two_loops(seed)).lap, 0).moved_tags.empty()) << seed;
  }
}

TEST(LapMoves, AreFoundIfSizesAreExact) {
  const test::RingShape shape = two_loops(44);
  RingDrive drive = drive_ring(shape);
  test::move_tag(drive, shape, 6, SE3({}, {0.05, 0, 0}), between_passes(drive, 6));
  const BundleMap map = mapped(drive.lap, 0);
  ASSERT_EQ(map.moved_tags.size(), 1U);
  EXPECT_EQ(map.moved_tags[0].tag, ring_tag(6));
  EXPECT_LT(error_m(drive, map, 6), std::max(0.01, 3 * sigma_m(map, 6)));
}

/// A drive on which a tag is moved in view, at this share of its last pass.
RingDrive moved_in_view(const test::RingShape& shape, int number, const SE3& by, double share) {
  RingDrive drive = drive_ring(shape);
  std::vector<std::size_t> frames;
  for (std::size_t f = between_passes(drive, number); f < drive.lap.frames.size(); ++f) {
    if (std::ranges::count(drive.lap.frames[f].detections, ring_tag(number), &TagDetection::tag) > 0)
      frames.push_back(f);
  }
  EXPECT_GT(frames.size(), 20U);
  const auto at = static_cast<std::size_t>(share * static_cast<double>(frames.size()));
  test::move_tag(drive, shape, number, by, frames[at]);
  return drive;
}

TEST(LapMoves, ATagMovedInViewHasItsLastPose) {
  test::RingShape shape = two_loops(45);
  shape.frame_m = 0.025;
  for (const double share : {0.4, 0.6}) {
    const RingDrive drive = moved_in_view(shape, 7, SE3({}, {0.25, 0, 0}), share);
    const BundleMap map = mapped(drive.lap);
    ASSERT_EQ(map.moved_tags.size(), 1U) << share;
    EXPECT_EQ(map.moved_tags[0].tag, ring_tag(7));
    EXPECT_NEAR(map.moved_tags[0].distance_m, 0.25, 0.03);
    EXPECT_LT(error_m(drive, map, 7), std::max(0.01, 3 * sigma_m(map, 7)));
  }
}

TEST(LapMoves, AnAnchorMovedInViewDoesNotMoveTheFrame) {
  test::RingShape shape = two_loops(45);
  shape.frame_m = 0.025;
  for (const double share : {0.4, 0.6}) {
    SCOPED_TRACE(share);
    RingDrive drive = moved_in_view(shape, 0, SE3({}, {0.25, 0, 0}), share);
    drive.tags.tags.at(ring_tag(0)).map_T_tag = drive.lap.map_T_anchor;
    const BundleMap map = mapped(drive.lap);
    for (int number = 0; number < 12; ++number)
      EXPECT_LT(error_m(drive, map, number), std::max(0.01, 3 * sigma_m(map, number))) << number;
    const std::vector<SecondPlace> places = second_places(drive.lap, map);
    ASSERT_EQ(places.size(), 1U) << "the map has its first place, and this is reported";
    EXPECT_EQ(places[0].tag, ring_tag(0));
    EXPECT_NEAR(places[0].distance_m, 0.25, 0.03);
    EXPECT_TRUE(places[0].one_after_the_other);
    EXPECT_TRUE(map.moved_tags.empty()) << "the last place is not in the map";
    EXPECT_TRUE(map.missing_tags.empty());
  }
}

TEST(LapMoves, ATagMovedTwiceInViewHasItsLastPose) {
  test::RingShape shape = two_loops(48);
  shape.frame_m = 0.025;
  RingDrive drive = moved_in_view(shape, 7, SE3({}, {-0.3, 0, 0}), 0.3);
  std::vector<std::size_t> frames;
  for (std::size_t f = between_passes(drive, 7); f < drive.lap.frames.size(); ++f) {
    if (std::ranges::count(drive.lap.frames[f].detections, ring_tag(7), &TagDetection::tag) > 0)
      frames.push_back(f);
  }
  test::move_tag(drive, shape, 7, SE3({}, {-0.3, 0, 0}), frames[2 * frames.size() / 3]);
  const BundleMap map = mapped(drive.lap);
  EXPECT_LT(error_m(drive, map, 7), std::max(0.01, 3 * sigma_m(map, 7)));
  EXPECT_EQ(map.moved_tags.size() + second_places(drive.lap, map).size(), 1U) << "it is reported once";
}

TEST(LapMoves, ManyTagsInTwoPlacesHaveOneCause) {
  const test::RingShape shape = two_loops(49);
  RingDrive drive = drive_ring(shape);
  const std::size_t half = drive.lap.frames.size() / 2;
  for (int number = 1; number < 12; number += 2)
    test::move_tag(drive, shape, number, SE3({}, {0.25, 0, 0}), half);
  const BundleMap map = mapped(drive.lap);
  const std::vector<std::string> warnings = check_map(drive.lap, map);
  EXPECT_THAT(warnings, Contains(HasSubstr("of 12 tags appear at two places")));
  EXPECT_THAT(warnings, Not(Contains(HasSubstr("moved by"))));
  EXPECT_THAT(warnings, Not(Contains(HasSubstr("two places, "))));
}

TEST(LapMoves, ATagMovedDuringAnExtendingLapHasItsLastPose) {
  const test::RingShape shape = two_loops(46);
  const BundleMap first = mapped(drive_ring(two_loops(47)).lap);
  RingDrive drive = drive_ring(shape);
  test::move_tag(drive, shape, 7, SE3({}, {0.1, 0, 0}), between_passes(drive, 7));
  drive.lap.prior = LapPrior{.map = first.map};
  const BundleMap map = mapped(drive.lap);
  ASSERT_EQ(map.moved_tags.size(), 1U);
  EXPECT_EQ(map.moved_tags[0].tag, ring_tag(7));
  EXPECT_TRUE(map.prior_warnings.empty()) << "the move is reported once";
  EXPECT_EQ(map.prior_agreeing, 11);
  for (int number = 0; number < 12; ++number)
    EXPECT_LT(error_m(drive, map, number), std::max(0.01, 3 * sigma_m(map, number))) << number;
}

}  // namespace
}  // namespace waymark
