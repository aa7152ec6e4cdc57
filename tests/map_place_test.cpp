// Deviations of place and robot: a leaning anchor, wrong turns of odometry, and a camera mounting that
// differs from the robot file. Compared with the simulator's ground truth.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/circuit_lap.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/evaluation/map_errors.hpp"
#include "waymark/localization/landmarks.hpp"
#include "waymark/pipeline/lap_mapper.hpp"

namespace waymark {
namespace {

using namespace test;

TeachSetup setup_of(const Lap& lap) {
  return {.camera = lap.input.camera,
          .base_T_cam = lap.input.base_T_cam,
          .sizes = lap.input.sizes,
          .anchor = lap.input.anchor,
          .map_T_anchor = lap.input.map_T_anchor};
}

/// The circuit with an anchor that leans back.
World with_leaning_anchor(double lean_deg) {
  World world = circuit();
  MappedTag& anchor = world.tags.tags.at(world.anchor);
  const Eigen::Vector3d right = anchor.map_T_tag.rotation() * Eigen::Vector3d::UnitX();
  anchor.map_T_tag = SE3(SO3::exp(to_radians(lean_deg) * right) * anchor.map_T_tag.rotation(),
                         anchor.map_T_tag.translation());
  return world;
}

/// Accuracy of a map: distances between its tags, heights and tilts.
struct Shape {
  double rmse_m = 0, height_m = 0, lean_deg = 0;
};

Shape shape_of(const MappedLap& lap, const World& world) {
  const auto errors = tag_map_errors(lap.map, world.tags);
  Shape shape;
  const Landmarks landmarks(lap.map);
  for (const Landmark& tag : landmarks.all()) {
    const SE3& truth = world.tags.find(tag.tag)->map_T_tag;
    shape.height_m =
        std::max(shape.height_m, std::abs(tag.map_T_tag.translation().z() - truth.translation().z()));
    const Eigen::Vector3d up = tag.map_T_tag.rotation().inverse() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d true_up = truth.rotation().inverse() * Eigen::Vector3d::UnitZ();
    shape.lean_deg = std::max(shape.lean_deg, to_degrees(std::acos(std::min(1.0, up.dot(true_up)))));
  }
  shape.rmse_m = errors.rmse_m;
  return shape;
}

bool full() { return std::getenv("WAYMARK_FULL") != nullptr; }

/// The first two; all in the long run.
std::vector<double> some_of(const std::vector<double>& all) {
  return full() ? all : std::vector<double>(all.begin(), all.begin() + 2);
}

/// The pose of the anchor is not given, or is that of an upright tag.
TEST(MapOfAPlace, TheAnchorMayLean) {
  for (const double lean_deg : some_of({0.3, 30.0, 0.0, 0.15, 0.7, 3.0, 6.0, 15.0})) {
    const World world = with_leaning_anchor(lean_deg);
    const Lap lap = drive(5, {}, world);
    for (const bool given : {false, true}) {
      TeachSetup setup = setup_of(lap);
      setup.map_T_anchor = circuit().tags.find(world.anchor)->map_T_tag;
      setup.anchor_pose_given = given;
      const auto mapped = map_lap({lap.input.frames, lap.input.odometry}, setup);
      ASSERT_TRUE(mapped) << to_string(mapped.error());
      const Shape shape = shape_of(*mapped, world);
      const SE3& anchor = mapped->map.find(world.anchor)->map_T_tag;
      std::printf("lean %.2f deg, pose %s: %.1f mm rmse, heights to %.1f mm, upright to %.2f deg\n", lean_deg,
                  given ? "given" : "found", 1000 * shape.rmse_m, 1000 * shape.height_m, shape.lean_deg);
      EXPECT_LT(shape.height_m, 0.02);
      EXPECT_LT(shape.lean_deg, 1.0);
      EXPECT_LT(mapped->bundle->rejected, 0.01 * 24 * 200);
      ASSERT_TRUE(mapped->map.floor.covariance);
      EXPECT_LT((mapped->map.floor.normal - Eigen::Vector3d::UnitZ()).norm(), 1e-5);
      if (!given) {
        EXPECT_LT(anchor.translation().norm(), 1e-5) << "the map origin is the anchor's centre";
        EXPECT_NEAR((anchor.rotation() * Eigen::Vector3d::UnitZ()).y(), 0, 1e-3);
        continue;
      }
      EXPECT_LT(shape.rmse_m, 0.03);
      EXPECT_LT((anchor.translation() - setup.map_T_anchor.translation()).norm(), 1e-5);
      const bool reported = std::ranges::any_of(mapped->warnings, [&](const std::string& warning) {
        return warning.find(" tilted by ") != std::string::npos;
      });
      EXPECT_EQ(reported, lean_deg > 1) << "smaller leans are not reported";
    }
  }
}

/// Odometry of a skid-steered robot that turns only `gain` times as much as its wheels indicate.
std::vector<Odometry> skidding(const std::vector<Odometry>& odometry, double gain) {
  std::vector<Odometry> measured;
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    Odometry sample = odometry[i];
    if (i > 0) {
      SE2::Tangent twist = (odometry[i - 1].odom_T_base.inverse() * sample.odom_T_base).log();
      twist[2] /= gain;
      sample.odom_T_base = measured.back().odom_T_base * SE2::exp(twist);
    }
    measured.push_back(sample);
  }
  return measured;
}

TEST(MapOfAPlace, OdometryTurnsMayBeWrong) {
  const Lap lap = drive(6);
  const double right = worst_of_others(map_of(lap.input), {});
  for (const double gain : some_of({0.2, 1.2, 0.3, 0.45, 0.6, 0.85})) {
    for (const bool with_imu : {false, true}) {
      if (with_imu && gain > 1 && !full()) continue;
      LapInput input = lap.input;
      input.odometry = skidding(lap.input.odometry, gain);
      if (with_imu) input.imu = lap.imu;
      const BundleMap map = map_of(input);
      std::printf("yaw gain %.2f%s: worst tag %.1f mm (%.1f with good wheels), yaw scale %.3f +- %.3f%s\n",
                  gain, with_imu ? ", IMU" : "", 1000 * worst_of_others(map, {}), 1000 * right,
                  map.odometry_scales.yaw, map.odometry_scales_sigma.yaw, map.turns_by_gyro ? ", gyro" : "");
      EXPECT_LT(worst_of_others(map, {}), std::max(0.01, 1.1 * right));
      EXPECT_EQ(map.map.tags.size(), 24U);
      if (!map.turns_by_gyro) EXPECT_NEAR(map.odometry_scales.yaw, gain, 0.05 * gain);
      EXPECT_LT(static_cast<double>(map.rejected.size()), 0.02 * 24 * 150);
    }
  }
}

/// Odometry with varying skid: `gain` plus or minus `share`, with a period of five seconds.
std::vector<Odometry> skidding_by_turns(const std::vector<Odometry>& odometry, double gain, double share) {
  std::vector<Odometry> measured;
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    Odometry sample = odometry[i];
    if (i > 0) {
      SE2::Tangent twist = (odometry[i - 1].odom_T_base.inverse() * sample.odom_T_base).log();
      const double phase = 2 * std::numbers::pi * to_seconds(sample.stamp.time_since_epoch()) / 5;
      twist[2] /= gain + share * std::sin(phase);
      sample.odom_T_base = measured.back().odom_T_base * SE2::exp(twist);
    }
    measured.push_back(sample);
  }
  return measured;
}

/// A gyro then replaces odometry turns.
TEST(MapOfAPlace, AGyroReplacesTurnsOfSkiddingWheels) {
  const Lap lap = drive(6);
  LapInput input = lap.input;
  input.odometry = skidding_by_turns(lap.input.odometry, 0.45, 0.3);
  const double by_wheels = worst_of_others(map_of(input), {});
  constexpr double kBias_rad_s = 0.02;
  input.imu = lap.imu;
  for (ImuSample& sample : input.imu) sample.angular_velocity_rad_s.z() += kBias_rad_s;
  const BundleMap map = map_of(input);
  std::printf("varying skid: worst tag %.1f mm, with a gyro %.1f mm\n", 1000 * by_wheels,
              1000 * worst_of_others(map, {}));
  EXPECT_TRUE(map.turns_by_gyro);
  EXPECT_LT(worst_of_others(map, {}), 0.01);
}

/// The factor for odometry turns: the reciprocal of their slope over the true turns, per second.
double true_turn_scale(const Lap& lap, const std::vector<Odometry>& odometry) {
  constexpr std::size_t kSecond = 50;  // samples
  double both = 0;
  double worth = 0;
  for (std::size_t i = 0; i + kSecond < odometry.size(); i += kSecond) {
    const auto a = true_pose(lap, odometry[i].stamp);
    const auto b = true_pose(lap, odometry[i + kSecond].stamp);
    if (!a || !b) continue;
    double measured = 0;
    for (std::size_t k = i; k < i + kSecond; ++k)
      measured += (odometry[k].odom_T_base.inverse() * odometry[k + 1].odom_T_base).log()[2];
    const double turned = (a->inverse() * *b).log()[5];
    both += measured * turned;
    worth += turned * turned;
  }
  return worth / both;
}

/// A gyro with gaps supplies the turns outside the gaps, odometry within them.
TEST(MapOfAPlace, AGyroMayHaveGaps) {
  struct Case {
    const char* name;
    double period_s, without_s, offset_s;
  };
  const Lap lap = drive(6);
  LapInput input = lap.input;
  input.odometry = skidding_by_turns(lap.input.odometry, 0.45, 0.3);
  const double truth = true_turn_scale(lap, input.odometry);
  for (const Case& c : {Case{"without gaps", 1e3, 0, 0}, Case{"two thirds", 1e3, 20, 20},
                        Case{"in intervals", 4, 1.2, 0}, Case{"with short gaps", 2, 0.4, 0}}) {
    input.imu.clear();
    for (const ImuSample& sample : lap.imu) {
      const double t = to_seconds(sample.stamp.time_since_epoch()) - c.offset_s;
      if (t < 0 || std::fmod(t, c.period_s) >= c.without_s) input.imu.push_back(sample);
    }
    const BundleMap map = map_of(input);
    std::printf("gyro %s: worst tag %.1f mm, yaw scale %.3f +- %.3f (truth %.3f), %.0f %% without%s\n",
                c.name, 1000 * worst_of_others(map, {}), map.odometry_scales.yaw,
                map.odometry_scales_sigma.yaw, truth, 100 * map.without_gyro_share,
                map.turns_by_gyro ? ", gyro" : "");
    EXPECT_TRUE(map.turns_by_gyro) << c.name;
    EXPECT_LT(std::abs(map.odometry_scales.yaw - truth), 3 * map.odometry_scales_sigma.yaw) << c.name;
    EXPECT_LT(worst_of_others(map, {}), 0.01) << c.name;
    EXPECT_NEAR(map.without_gyro_share, c.without_s / std::min(c.period_s, 60.0), 0.05) << c.name;
  }
}

TEST(MapOfAPlace, AWrongMountingIsEstimatedAndUsed) {
  const Lap lap = drive(16, {.speed_m_s = 0.2, .second_speed_m_s = 0.6});
  const SE3 truth = lap.input.base_T_cam;
  LapInput wrong = lap.input;
  wrong.base_T_cam = SE3(SO3::from_rpy(0, to_radians(2), 0) * truth.rotation(),
                         truth.translation() + Eigen::Vector3d(0.02, 0, 0));
  const BundleMap map = map_of(wrong);
  ASSERT_TRUE(map.mounting);
  EXPECT_TRUE(map.mounting_used);
  EXPECT_TRUE(map.moved_tags.empty()) << "a wrong mounting is not explained by moved tags";
  const Eigen::Vector3d turned = (map.mounting->base_T_cam.rotation() * truth.rotation().inverse()).log();
  std::printf("2 deg off found to %.2f deg; worst tag %.1f mm\n", to_degrees(turned.norm()),
              1000 * worst_of_others(map, {}));
  EXPECT_LT(to_degrees(turned.norm()), 0.3);
  EXPECT_LT(worst_of_others(map, {}), 0.02);
  EXPECT_THAT(check_map(wrong, map), ::testing::Contains(::testing::HasSubstr("robot.yaml")));
  const BundleMap right = map_of(lap.input);
  EXPECT_FALSE(right.mounting_used) << "a correct mounting is not changed";
  BundleMapOptions options;
  options.keep_mounting = true;
  const auto kept = map_by_bundle(wrong, {}, options);
  ASSERT_TRUE(kept);
  EXPECT_FALSE(kept->mounting_used);
}

}  // namespace
}  // namespace waymark
