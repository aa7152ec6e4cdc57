// Scenes with wrong odometry: one wrong motion, more noise than stated, and an error where nothing else
// connects two groups of tags. The errors of the maps are compared with their covariances.
#include "waymark/mapping/scene/odometry_checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/rig_scene.hpp"
#include "tests/support/scene_outcome.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/scene/scene_report.hpp"

namespace waymark {
namespace {

using test::mapped;
using test::Outcome;
using test::WideScene;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

constexpr double kSigmaM = 0.002;
constexpr double kSigmaRad = 0.001;

/// Normalised squared errors of tag positions.
struct PositionErrors {
  double mean = 0;  ///< divided by 3
  double worst_sigmas = 0;
};

PositionErrors position_errors(const WideScene& wide, const SceneMap& map) {
  PositionErrors errors;
  int count = 0;
  for (std::size_t t = 1; t < map.scene.bodies[0].tags.size(); ++t) {
    const auto map_T_tag = map.map_T_tag(0, t);
    if (!map_T_tag) continue;
    const Uncertain<SE3> placed{*map_T_tag, map.covariance.poses[map.problem.tags[0][t]]};
    const Eigen::Matrix3d P = coordinate_covariance(placed).topLeftCorner<3, 3>();
    const Eigen::Vector3d off =
        wide.truth.at(map.scene.bodies[0].tags[t].id.number).translation() - map_T_tag->translation();
    const double chi2 = off.dot(P.llt().solve(off));
    errors.mean += chi2 / 3;
    errors.worst_sigmas = std::max(errors.worst_sigmas, std::sqrt(chi2));
    ++count;
  }
  errors.mean /= std::max(count, 1);
  return errors;
}

/// From this frame on, odometry is off by this motion, as after a person has moved the robot.
void jump(WideScene& wide, std::size_t frame, const SE3& by) {
  for (std::size_t f = frame; f < wide.recording.odometry.size(); ++f) {
    SE3& pose = wide.recording.odometry[f].odom_T_sensor;
    const SE3 origin = wide.recording.odometry[frame].odom_T_sensor;
    pose = origin * by * origin.inverse() * pose;
  }
}

TEST(OdometryChecks, AcceptGoodOdometry) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const bool above : {false, true}) {
      WideScene wide = above ? test::ceiling(100, seed) : test::aisles(60, seed);
      test::add_odometry(wide, kSigmaM, kSigmaRad, 100 + seed);
      SceneMap map;
      mapped(wide, &map);
      std::printf("seed %d: noise %.2f of that stated\n", static_cast<int>(seed), map.odometry_ratio);
      EXPECT_THAT(scene_warnings(map), IsEmpty()) << seed;
      EXPECT_LT(map.odometry_ratio, 1.2) << seed;
      EXPECT_LT(position_errors(wide, map).worst_sigmas, 5) << seed;
    }
  }
}

TEST(OdometryChecks, RejectOneWrongMotion) {
  const bool full = std::getenv("WAYMARK_FULL") != nullptr;
  for (const double metres : {0.1, 2.0, 10.0}) {
    const std::uint64_t seeds = full || metres == 2 ? 3 : 1;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      WideScene wide = test::aisles(60, seed);
      test::add_odometry(wide, kSigmaM, kSigmaRad, 200 + seed);
      const Outcome without = mapped(wide);
      constexpr std::size_t kFrame = 140;
      jump(wide, kFrame, test::at(metres, 0, 0));
      SceneMap map;
      const Outcome outcome = mapped(wide, &map);
      const PositionErrors errors = position_errors(wide, map);
      std::printf("%.1f m, seed %d: %.4f m, without %.4f m; %.1f sigma at most\n", metres,
                  static_cast<int>(seed), outcome.mean_m, without.mean_m, errors.worst_sigmas);
      EXPECT_EQ(outcome.tags, 60U);
      EXPECT_LT(outcome.mean_m, 2 * without.mean_m + 0.005);
      EXPECT_LT(errors.worst_sigmas, 5);
      EXPECT_TRUE(map.wrong_sizes.empty());
      EXPECT_THAT(map.duplicate_tags, IsEmpty());
      ASSERT_EQ(map.rejected_odometry.size(), 1U);
      EXPECT_NEAR(map.rejected_odometry[0].off_m, metres, 0.02);
      EXPECT_NEAR(map.rejected_odometry[0].from_s, 0.1 * (kFrame - 1), 1e-6);
      EXPECT_NEAR(map.rejected_odometry[0].to_s, 0.1 * kFrame, 1e-6);
      EXPECT_THAT(scene_warnings(map), ElementsAre(StartsWith("odometry between 13.90 s and 14.00 s")));
    }
  }
}

// All tags of the second pass then appear at other places, like duplicate tags.
TEST(OdometryChecks, AWrongMotionBetweenTwoPassesIsNotTheCauseOfDuplicateTags) {
  const std::vector<SE3> motions = {test::at(0, 20, 0), test::at(0, 0, 0, 0, 0, 1.5708)};
  for (const SE3& by : motions) {
    WideScene wide = test::aisles(60, 1, 0.2, {{1, SE3()}});
    test::add_odometry(wide, kSigmaM, kSigmaRad, 401);
    const Outcome without = mapped(wide);
    jump(wide, wide.recording.odometry.size() / 2, by);
    SceneMap map;
    const Outcome outcome = mapped(wide, &map);
    EXPECT_EQ(outcome.tags, 60U);
    EXPECT_LT(outcome.mean_m, 1.5 * without.mean_m);
    EXPECT_THAT(map.duplicate_tags, IsEmpty());
    ASSERT_EQ(map.rejected_odometry.size(), 1U);
    if (by.translation().norm() > 0)
      EXPECT_NEAR(map.rejected_odometry[0].off_m, by.translation().norm(), 0.05);
    else
      EXPECT_NEAR(map.rejected_odometry[0].off_rad, by.rotation().log().norm(), 0.02);
  }
}

TEST(OdometryChecks, AWrongMotionDuringTheSecondPassIsNotTheCauseOfDuplicateTags) {
  WideScene wide = test::aisles(60, 2, 0.2, {{1, SE3()}});
  test::add_odometry(wide, kSigmaM, kSigmaRad, 402);
  const Outcome without = mapped(wide);
  jump(wide, wide.recording.odometry.size() * 3 / 4, test::at(0, 20, 0));
  SceneMap map;
  EXPECT_LT(mapped(wide, &map).mean_m, 1.5 * without.mean_m);
  EXPECT_THAT(map.duplicate_tags, IsEmpty());
  EXPECT_EQ(map.rejected_odometry.size(), 1U);
}

TEST(OdometryChecks, UnderstatedNoiseIsNotTheCauseOfDuplicateTags) {
  WideScene wide = test::aisles(60, 3, 0.2, {{1, SE3()}});
  test::add_odometry(wide, 20 * kSigmaM, 20 * kSigmaRad, 403);
  wide.scene.bodies[1].odometry = {.sigma_m = kSigmaM, .sigma_rad = kSigmaRad};
  SceneMap map;
  EXPECT_LT(mapped(wide, &map).mean_m, 0.05);
  EXPECT_THAT(map.duplicate_tags, IsEmpty());
}

TEST(OdometryChecks, EstimateItsNoise) {
  const int seeds = std::getenv("WAYMARK_FULL") != nullptr ? 10 : 2;
  for (const double times : {3.0, 20.0}) {
    double nees = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
      WideScene wide = test::aisles(60, static_cast<std::uint64_t>(seed));
      test::add_odometry(wide, times * kSigmaM, times * kSigmaRad, 300 + static_cast<std::uint64_t>(seed));
      wide.scene.bodies[1].odometry = {.sigma_m = kSigmaM, .sigma_rad = kSigmaRad};
      SceneMap map;
      const Outcome outcome = mapped(wide, &map);
      const PositionErrors errors = position_errors(wide, map);
      std::printf("%.0f times, seed %d: %.1f, %.4f m, NEES/3 %.2f\n", times, seed, map.odometry_ratio,
                  outcome.mean_m, errors.mean);
      EXPECT_NEAR(map.odometry_ratio, times, 0.2 * times);
      EXPECT_LT(map.noise_px, 0.25) << "corner noise is 0.2 px";
      EXPECT_TRUE(map.wrong_sizes.empty());
      EXPECT_THAT(map.duplicate_tags, IsEmpty());
      EXPECT_TRUE(map.rejected_odometry.empty());
      EXPECT_THAT(scene_warnings(map), ElementsAre(HasSubstr("times noisier than stated")));
      EXPECT_LT(errors.worst_sigmas, 5);
      nees += errors.mean / seeds;
    }
    // The errors of the tags of one map are strongly correlated.
    EXPECT_GT(nees, 0.2);
    EXPECT_LT(nees, 2.5);
  }
}

/// Two groups of tags that this many images show together.
WideScene two_groups(int images, std::uint64_t seed) {
  WideScene wide = test::aisles(60, seed);
  for (SceneFrame& frame : wide.recording.frames) {
    auto& seen = frame.views[0].detections;
    const auto first = [](const TagDetection& d) { return d.tag.number <= 30; };
    if (std::ranges::all_of(seen, first) || std::ranges::none_of(seen, first)) continue;
    if (images-- <= 0) std::erase_if(seen, first);
  }
  return wide;
}

TEST(OdometryChecks, NameTagsThatOdometryAloneConnects) {
  for (const int images : {0, 4}) {
    WideScene wide = two_groups(images, 7);
    test::add_odometry(wide, kSigmaM, kSigmaRad, 8);
    SceneMap map;
    const Outcome outcome = mapped(wide, &map);
    EXPECT_EQ(outcome.tags, 60U);
    EXPECT_LT(position_errors(wide, map).worst_sigmas, 5);
    if (images > 0) {
      EXPECT_TRUE(map.odometry_links.empty());
      EXPECT_THAT(scene_warnings(map), IsEmpty());
      continue;
    }
    ASSERT_EQ(map.odometry_links.size(), 1U);
    EXPECT_EQ(map.odometry_links[0].beyond.size(), 29U);
    EXPECT_EQ(map.odometry_links[0].beyond.front().number, 31);
    EXPECT_EQ(map.odometry_links[0].frames, 1);
    EXPECT_NEAR(map.odometry_links[0].length_m, 0.07, 0.02);
    EXPECT_THAT(scene_warnings(map),
                ElementsAre(AllOf(StartsWith("tags 31-59:"), HasSubstr("by odometry alone"))));
  }
}

TEST(OdometryChecks, KeepOdometryThatAloneConnectsTags) {
  WideScene wide = two_groups(0, 7);
  test::add_odometry(wide, kSigmaM, kSigmaRad, 8);
  std::size_t frame = 0;
  while (wide.recording.frames[frame].views[0].detections.empty() ||
         wide.recording.frames[frame].views[0].detections[0].tag.number <= 30)
    ++frame;
  jump(wide, frame, test::at(5, 0, 0));
  SceneMap map;
  EXPECT_EQ(mapped(wide, &map).tags, 60U);
  EXPECT_TRUE(map.rejected_odometry.empty()) << "nothing contradicts it";
  EXPECT_THAT(scene_warnings(map), Contains(HasSubstr("by odometry alone")));
}

TEST(OdometryChecks, LeaveTagslamsModelAlone) {
  WideScene wide = test::aisles(30, 4);
  test::add_odometry(wide, kSigmaM, kSigmaRad, 9);
  jump(wide, 60, test::at(0.1, 0, 0));
  const auto map = map_scene(wide.scene, wide.recording, {.model = SceneModel::Tagslam});
  ASSERT_TRUE(map) << to_string(map.error());
  EXPECT_EQ(map->odometry_ratio, 1);
  EXPECT_TRUE(map->rejected_odometry.empty());
  for (const RelativeTerm& term : map->problem.bundle.relatives) {
    EXPECT_TRUE(term.used);
    EXPECT_FALSE(term.robust);
  }
}

}  // namespace
}  // namespace waymark
