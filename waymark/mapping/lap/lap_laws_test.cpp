// Invariants of the map made from any lap, tested on a ring. The choice of the anchor, the unit of length,
// the clock and the direction of turns do not matter; covariances are positive definite; a search stops on
// request.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include "tests/support/ring_drive.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/lap/bundle_map.hpp"

namespace waymark {
namespace {

using test::drive_ring;
using test::ring_tag;
using test::RingDrive;
using ::testing::Contains;
using ::testing::HasSubstr;

BundleMap mapped(const LapInput& lap) {
  auto map = map_by_bundle(lap);
  EXPECT_TRUE(map) << to_string(map.error());
  return map ? std::move(*map) : BundleMap();
}

RingDrive noisy(std::uint64_t seed = 1) {
  return drive_ring({.noise_px = 0.05, .odometry_sigma_m = 5e-4, .odometry_sigma_rad = 1e-3, .seed = seed});
}

TEST(RingLaws, IsExactWithoutNoise) {
  const RingDrive drive = drive_ring();
  const BundleMap map = mapped(drive.lap);
  ASSERT_EQ(map.map.tags.size(), 12U);
  for (const auto& [id, tag] : map.map.tags)
    EXPECT_LT(minus(tag.map_T_tag, drive.tags.tags.at(id).map_T_tag).norm(), 1e-4) << id.number;
  EXPECT_EQ(map.frames_without_pose, 0);
  EXPECT_NEAR(map.odometry_scales.distance, 1, 1e-3);
  EXPECT_NEAR(map.odometry_scales.yaw, 1, 1e-3);
}

TEST(RingLaws, CovariancesArePositiveDefiniteAndFollowTheAnchor) {
  const RingDrive drive = noisy();
  LapInput elsewhere = drive.lap;
  const SE3 by(SO3::from_rpy(0, 0, 1.1), {4, -3, 0.5});
  elsewhere.map_T_anchor = by * elsewhere.map_T_anchor;
  const BundleMap here = mapped(drive.lap);
  const BundleMap there = mapped(elsewhere);
  const Matrix6 Ad = by.adjoint();
  for (const auto& [id, tag] : here.map.tags) {
    ASSERT_TRUE(tag.covariance) << id.number;
    const Matrix6& P = *tag.covariance;
    EXPECT_LT((P - P.transpose()).norm(), 1e-9 * P.norm());
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6>(P).eigenvalues().minCoeff(), 0) << id.number;
    const Matrix6 expected = Ad * P * Ad.transpose();
    EXPECT_LT((*there.map.tags.at(id).covariance - expected).norm(), 1e-2 * expected.norm()) << id.number;
  }
  ASSERT_EQ(here.trajectory_covariance.size(), here.trajectory.size());
  for (std::size_t i = 0; i < here.trajectory.size(); i += 20)
    EXPECT_LT((there.trajectory_covariance[i] - Ad * here.trajectory_covariance[i] * Ad.transpose()).norm(),
              1e-2 * there.trajectory_covariance[i].norm());
}

TEST(RingLaws, ALapOfTwiceTheSizeHasAMapOfTwiceTheSize) {
  const RingDrive drive = drive_ring();
  LapInput large = drive.lap;
  const auto grow = [](SE3& pose) { pose = SE3(pose.rotation(), 2 * pose.translation()); };
  *large.sizes.default_size_m *= 2;
  grow(large.base_T_cam);
  grow(large.map_T_anchor);
  for (Odometry& sample : large.odometry)
    sample.odom_T_base = SE2(sample.odom_T_base.rotation(), 2 * sample.odom_T_base.translation());
  const BundleMap map = mapped(drive.lap);
  const BundleMap other = mapped(large);
  EXPECT_NEAR(other.odometry_scales.distance, map.odometry_scales.distance, 1e-3);
  for (const auto& [id, tag] : map.map.tags) {
    SE3 expected = tag.map_T_tag;
    grow(expected);
    EXPECT_LT(minus(other.map.tags.at(id).map_T_tag, expected).norm(), 1e-3) << id.number;
  }
}

TEST(RingLaws, TheTimeOfTheLapDoesNotMatter) {
  const RingDrive drive = noisy();
  LapInput later = drive.lap;
  const Duration by = std::chrono::hours(24 * 365 * 50);
  for (TagFrame& frame : later.frames) frame.stamp += by;
  for (Odometry& sample : later.odometry) sample.stamp += by;
  const BundleMap map = mapped(drive.lap);
  const BundleMap other = mapped(later);
  EXPECT_EQ(other.trajectory.front().stamp, map.trajectory.front().stamp + by);
  for (const auto& [id, tag] : map.map.tags)
    EXPECT_EQ(other.map.tags.at(id).map_T_tag.matrix(), tag.map_T_tag.matrix()) << "exactly equal";
}

TEST(RingLaws, TheStartOfOdometryDoesNotMatter) {
  const RingDrive drive = noisy();
  LapInput other = drive.lap;
  for (Odometry& sample : other.odometry) sample.odom_T_base = SE2(100, -50, 2.5) * sample.odom_T_base;
  const BundleMap a = mapped(drive.lap);
  const BundleMap b = mapped(other);
  for (const auto& [id, tag] : a.map.tags)
    EXPECT_LT(minus(b.map.tags.at(id).map_T_tag, tag.map_T_tag).norm(), 1e-5) << id.number;
}

TEST(RingLaws, WrongOdometryScalesAreEstimated) {
  for (const auto& [distance, yaw] : {std::pair(1.1, 1.0), std::pair(0.95, 0.9), std::pair(2.0, 0.5)}) {
    const RingDrive drive = drive_ring({.odometry_distance = distance, .odometry_yaw = yaw});
    const BundleMap map = mapped(drive.lap);
    EXPECT_NEAR(map.odometry_scales.distance * distance, 1, 0.01) << distance << " " << yaw;
    EXPECT_NEAR(map.odometry_scales.yaw * yaw, 1, 0.01) << distance << " " << yaw;
    for (const auto& [id, tag] : map.map.tags)
      EXPECT_LT((tag.map_T_tag.translation() - drive.tags.tags.at(id).map_T_tag.translation()).norm(), 0.02);
  }
}

TEST(RingLaws, ASecondCameraAddsObservationsWithTheSameBasePoses) {
  const RingDrive two = drive_ring({.noise_px = 0.05, .rear = true});
  LapInput front = two.lap;
  std::erase_if(front.frames, [](const TagFrame& frame) { return frame.camera == "rear"; });
  front.more_cameras.clear();
  const BundleMap with_both = mapped(two.lap);
  const BundleMap with_front = mapped(front);
  EXPECT_EQ(with_both.trajectory.size(), with_front.trajectory.size());
  for (const auto& [id, tag] : with_both.map.tags) {
    EXPECT_GE(with_both.observations.at(id), with_front.observations.at(id));
    EXPECT_LT((tag.map_T_tag.translation() - two.tags.tags.at(id).map_T_tag.translation()).norm(), 0.01);
    if (id != two.lap.anchor) {
      EXPECT_LT(tag.covariance->trace(), 1.05 * with_front.map.tags.at(id).covariance->trace()) << id.number;
    }
  }
}

TEST(RingLaws, ASearchStopsOnRequestAtAnyStep) {
  const RingDrive drive = noisy();
  std::vector<std::string> stages;
  int steps = 0;
  ASSERT_TRUE(map_by_bundle(drive.lap, {}, {}, [&](const std::string& stage, int, double) {
    if (stages.empty() || stages.back() != stage) stages.push_back(stage);
    ++steps;
    return true;
  }));
  EXPECT_EQ(stages.front(), "composing the initial map");
  EXPECT_EQ(stages.back(), "computing the covariance");
  EXPECT_THAT(stages, Contains("rejecting outliers"));
  for (int last = 1; last <= steps; last += std::max(1, steps / 12)) {
    int asked = 0;
    const auto stopped =
        map_by_bundle(drive.lap, {}, {}, [&](const std::string&, int, double) { return ++asked < last; });
    ASSERT_FALSE(stopped) << last << " of " << steps;
    EXPECT_EQ(stopped.error().code, ErrorCode::LimitExceeded) << last;
    EXPECT_EQ(asked, last) << "the callback is not called again";
  }
}

TEST(RingLaws, OptionsOutOfRangeAreReported) {
  const RingDrive drive = drive_ring({.loops = 0.3});
  BundleMapOptions options;
  options.model.corner_sigma_px = -1;
  const auto map = map_by_bundle(drive.lap, {}, options);
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(map.error().place.key, HasSubstr("corner_sigma_px"));
  ChainOptions chain;
  chain.max_distance_m = -1;
  const auto none = map_by_bundle(drive.lap, chain);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().place.key, HasSubstr("max_distance_m"));
}

TEST(RingLaws, ATagWithoutASizeIsNotMappedAndHasNoEffect) {
  RingDrive drive = drive_ring();
  drive.lap.sizes.default_size_m.reset();
  for (int number = 0; number < 12; ++number) {
    if (number != 5) drive.lap.sizes.size_by_tag_m[ring_tag(number)] = 0.16;
  }
  const BundleMap map = mapped(drive.lap);
  EXPECT_EQ(map.map.tags.size(), 11U);
  EXPECT_FALSE(map.map.tags.contains(ring_tag(5)));
  drive.lap.sizes.size_by_tag_m.clear();
  EXPECT_FALSE(map_by_bundle(drive.lap)) << "no tag has a size";
}

}  // namespace
}  // namespace waymark
