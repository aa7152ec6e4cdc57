// Defects of a lap of circuit24 are reported, one defect at a time.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include <gmock/gmock.h>

#include "tests/support/circuit_lap.hpp"
#include "tests/support/warehouse.hpp"
#include "waymark/evaluation/map_errors.hpp"
#include "waymark/mapping/lap/map_checks.hpp"

namespace waymark {
namespace {

using namespace test;
using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

/// One lap at one speed determines the mounting less well than the map, because slip has the same effect.
TEST(MapChecks, ReportsAWrongCameraMounting) {
  constexpr double kDegrees = 57.29577951308232;
  Lap lap = drive(16);
  const SE3 truth = lap.input.base_T_cam;
  lap.input.base_T_cam = SE3(SO3::exp({0, 0, 8 / kDegrees}) * truth.rotation(),
                             truth.translation() + Eigen::Vector3d(0.15, 0, 0));
  const BundleMap map = map_of(lap.input);
  ASSERT_TRUE(map.mounting);
  EXPECT_THAT(check_map(lap.input, map), Contains(HasSubstr("camera mounting")));
  EXPECT_TRUE(map.moved_tags.empty()) << "a wrong mounting is not explained by moved tags";
  const SE3& found = map.mounting->base_T_cam;
  Vector6 off;
  off << found.translation() - truth.translation(), (found.rotation() * truth.rotation().inverse()).log();
  std::printf("camera estimated %.1f mm (2 sigma %.1f) and %.2f deg (%.2f) from its true mounting\n",
              1000 * off.head<2>().norm(), 2000 * map.mounting->sigma.head<2>().norm(),
              kDegrees * off.tail<3>().norm(), 2 * kDegrees * map.mounting->sigma.tail<3>().norm());
  for (int i : {0, 1, 3, 4, 5}) EXPECT_LT(std::abs(off[i]), 3 * map.mounting->sigma[i]) << i;
  BundleMapOptions options;
  options.find_mounting = true;
  const auto corrected = map_by_bundle(lap.input, {}, options);
  ASSERT_TRUE(corrected);
  EXPECT_TRUE(corrected->mounting_used);
  EXPECT_LT(trajectory_errors(corrected->trajectory, lap.truth).rmse_m,
            trajectory_errors(map.trajectory, lap.truth).rmse_m);
}

/// Pose errors from tags pull the base to where they vary least, nearer to the tags: by 3 cm in each of these
/// laps, if heights and turn noise had full weight.
TEST(MapChecks, TheForwardPositionIsNotBiasedTowardsTheTags) {
  double sum_m = 0;
  for (const std::uint64_t seed : {10U, 11U, 12U}) {
    Lap lap = drive(seed);
    const SE3 truth = lap.input.base_T_cam;
    lap.input.base_T_cam =
        SE3(SO3::exp({0, 0, 0.14}) * truth.rotation(), truth.translation() + Eigen::Vector3d(0.15, 0, 0));
    const BundleMap map = map_of(lap.input);
    ASSERT_TRUE(map.mounting);
    EXPECT_TRUE(map.mounting->out[0]) << seed;
    const double off_m = map.mounting->base_T_cam.translation().x() - truth.translation().x();
    std::printf("seed %llu: forward position off by %.1f mm, sigma %.1f\n",
                static_cast<unsigned long long>(seed), 1000 * off_m, 1000 * map.mounting->sigma[0]);
    sum_m += off_m;
  }
  EXPECT_LT(std::abs(sum_m / 3), 0.02);
}

/// Odometry with lateral drift, whose speed changes every half second, beyond the assumed noise.
std::vector<Odometry> drifting(const std::vector<Odometry>& odometry, std::uint64_t seed) {
  constexpr double kDrift_m_s = 0.1;
  Random random(seed);
  std::vector<Odometry> drifted = odometry;
  double drift_m_s = 0;
  SensorTime changes = odometry.front().stamp;
  for (std::size_t i = 1; i < odometry.size(); ++i) {
    if (odometry[i].stamp >= changes) {
      drift_m_s = kDrift_m_s * random.normal();
      changes = odometry[i].stamp + std::chrono::milliseconds(500);
    }
    SE2::Tangent motion = (odometry[i - 1].odom_T_base.inverse() * odometry[i].odom_T_base).log();
    motion.y() += drift_m_s * to_seconds(odometry[i].stamp - odometry[i - 1].stamp);
    drifted[i].odom_T_base = drifted[i - 1].odom_T_base * SE2::exp(motion);
  }
  return drifted;
}

/// Odometry with more noise than assumed makes the error of a correct mounting look significant.
TEST(MapChecks, ACorrectMountingIsKept) {
  const World world = read_world(WAYMARK_SHARE "/worlds/mbot-square.yaml").value();
  const RobotDescription mbot = read_robot(WAYMARK_SHARE "/robots/mbot.yaml").value();
  int tempting = 0;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    Lap lap = drive(seed, {}, world, mbot);
    lap.input.sizes = {.default_size_m = world.tags.tags.begin()->second.size_m};
    lap.input.odometry = drifting(lap.input.odometry, seed);
    const BundleMap map = map_of(lap.input);
    ASSERT_TRUE(map.mounting);
    const Vector6& off = map.mounting->off;
    const Vector6& sigma = map.mounting->sigma;
    for (int i : {0, 1, 3, 4, 5}) tempting += std::abs(off[i]) > std::max(0.01, 4 * sigma[i]) ? 1 : 0;
    std::printf("seed %d: ahead %+.1f mm (sigma %.1f), to the left %+.1f (%.1f), trajectory %.1f mm\n",
                static_cast<int>(seed), 1000 * off[0], 1000 * sigma[0], 1000 * off[1], 1000 * sigma[1],
                1000 * trajectory_errors(map.trajectory, lap.truth).rmse_m);
    EXPECT_FALSE(map.mounting_used) << seed;
    EXPECT_TRUE(map.moved_tags.empty()) << seed;
    EXPECT_THAT(check_map(lap.input, map), Not(Contains(HasSubstr("camera mounting")))) << seed;
  }
  EXPECT_GT(tempting, 0) << "the first estimate alone is right on every lap";
}

TEST(MapChecks, ReportsACalibrationOfAnotherCamera) {
  Lap lap = drive(17);
  lap.input.camera =
      CameraModel::make(
          PinholeRadtan{.fx = 480, .fy = 480, .cx = 330, .cy = 235, .k = {0.1}, .coefficients = 4}, 640, 480)
          .value();
  const auto map = map_by_bundle(lap.input);
  if (!map) return;  // an error is correct too
  EXPECT_THAT(check_map(lap.input, *map), Contains(HasSubstr("`waymark calibrate camera`")));
}

TEST(MapChecks, ReportsACoveredCamera) {
  Lap lap = drive(18);
  const std::size_t middle = lap.input.frames.size() / 2;
  for (std::size_t i = middle; i < middle + 45; ++i) lap.input.frames[i].detections.clear();
  const BundleMap map = map_of(lap.input);
  EXPECT_THAT(check_map(lap.input, map), Contains(ContainsRegex("no mapped tag .* 3\\.")));
  for (std::size_t i = middle; i < lap.input.frames.size(); ++i) lap.input.frames[i].detections.clear();
  lap.input.odometry.clear();
  const BundleMap half = map_of(lap.input);
  EXPECT_GT(half.frames_without_pose, 0);
  EXPECT_LT(half.map.tags.size(), 24U);
  EXPECT_LT(worst_of_others(half, {}), 0.1) << "the tags that are determined";
}

TEST(MapChecks, OneTagIsAMapAndUnconnectedGroupsAreNotJoined) {
  Lap lap = drive(19);
  Lap alone = lap;
  for (TagFrame& frame : alone.input.frames)
    std::erase_if(frame.detections, [&](const TagDetection& d) { return d.tag != alone.input.anchor; });
  const auto one = map_by_bundle(alone.input);
  ASSERT_TRUE(one) << to_string(one.error());
  EXPECT_EQ(one->map.tags.size(), 1U);
  for (TagFrame& frame : lap.input.frames)
    std::erase_if(frame.detections,
                  [&](const TagDetection& d) { return d.tag.number != 0 && d.tag.number != 12; });
  lap.input.odometry.clear();
  const BundleMap two = map_of(lap.input);
  EXPECT_EQ(two.map.find(tag(12)), nullptr) << "its pose is unknown";
  EXPECT_THAT(check_map(lap.input, two), Contains(HasSubstr("tag36h11:12 ")));
}

TEST(MapChecks, ReportsTagsOnOneLine) {
  BundleMap map;
  for (int i = 0; i < 5; ++i) map.map.tags[tag(i)] = {SE3({}, {1.0 * i, 0.01 * (i % 2), 0.3}), 0.16};
  std::vector<std::string> warnings;
  waymark::internal::check_line(map, warnings);
  EXPECT_THAT(warnings, ::testing::ElementsAre(HasSubstr("one line")));
  map.map.tags[tag(7)] = {SE3({}, {2, 1, 0.3}), 0.16};
  warnings.clear();
  waymark::internal::check_line(map, warnings);
  EXPECT_TRUE(warnings.empty());
}

/// An aisle with signs on the left only, or on both sides.
LapInput aisle(bool only_left) {
  LapInput lap = drive_warehouse({.tags = 100}).lap;
  for (TagFrame& frame : lap.frames) {
    std::erase_if(frame.detections,
                  [&](const TagDetection& seen) { return only_left && seen.tag.number % 2 != 0; });
  }
  return lap;
}

TEST(MapChecks, ReportsASingleRowOfTags) {
  const LapInput line = aisle(true);
  EXPECT_THAT(check_map(line, map_of(line)), Contains(HasSubstr("one line")));
  const LapInput both = aisle(false);
  EXPECT_THAT(check_map(both, map_of(both)), Not(Contains(HasSubstr("one line"))));
}

TEST(MapChecks, ReportsTheLoopClosureError) {
  const Lap lap = drive(1);
  const BundleMap map = map_of(lap.input);
  const auto loop = loop_closure(lap.input, map);
  ASSERT_TRUE(loop);
  std::printf("%s after %.1f m: wheels %.3f m and %.2f deg off, adjusted %.4f m\n",
              to_string(loop->tag).c_str(), loop->way_m, loop->before_m, 57.3 * loop->before_rad,
              loop->after_m);
  EXPECT_GT(loop->way_m, 8);
  // A gyro bias of 0.002 rad/s over more than half a minute, and a distance scale 2 % off.
  EXPECT_GT(loop->before_m, 0.05);
  EXPECT_LT(loop->before_m, 2);
  EXPECT_LT(loop->after_m, 0.03);
  LapInput open = lap.input;
  std::erase_if(open.frames, [&](const TagFrame& frame) {
    return to_seconds(frame.stamp - lap.input.frames.front().stamp) > 9;
  });
  EXPECT_FALSE(loop_closure(open, map));
}

}  // namespace
}  // namespace waymark
