#include "waymark/pipeline/localizer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

constexpr double kSize_m = 0.16;

CameraModel some_camera() {
  return CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value();
}

/// The camera points forward from 0.2 m above the base.
SE3 mounting() { return {body_R_optical(), {0.05, 0, 0.2}}; }

/// A wall of tags three metres ahead, all facing the robot.
TagMap wall() {
  TagMap map;
  for (int i = 0; i < 5; ++i) {
    const SO3 map_R_tag = body_R_optical();  // axes as for a camera: x right, y down, z into the wall
    map.tags[{FamilyId::Tag36h11, i}] = {.map_T_tag = SE3(map_R_tag, {3, 0.5 * (i - 2), 0.3}),
                                         .size_m = kSize_m};
  }
  return map;
}

LocalizerSetup setup_with(const std::string& method) {
  return {.landmarks = Landmarks(wall()),
          .tags = wall(),
          .sensor = {some_camera(), mounting()},
          .method = parse_localization_method(method).value()};
}

TagFrame frame_from(const SE2& map_T_base, SensorTime stamp) {
  TagFrame frame{.stamp = stamp};
  const SE3 cam_T_map = (lift(map_T_base) * mounting()).inverse();
  for (const auto& [id, tag] : wall().tags)
    if (const auto corners = visible_corners(some_camera(), cam_T_map * tag.map_T_tag, tag.size_m))
      frame.detections.push_back({.tag = id, .corners_px = *corners});
  return frame;
}

SensorTime at(int step) { return SensorTime(std::chrono::milliseconds(50 * step)); }

/// Drives towards the wall at 0.3 m/s in a gentle bend; returns the final pose.
SE2 drive(Localizer& localizer, int steps) {
  SE2 map_T_base(0.2, -0.1, 0.05);
  const SE2 start = map_T_base;
  for (int i = 0; i < steps; ++i) {
    localizer.add(Odometry{at(i), start.inverse() * map_T_base, 0.3, 0.05});
    localizer.add(frame_from(map_T_base, at(i)));
    if (i + 1 < steps) map_T_base = map_T_base * SE2::exp({0.05 * 0.3, 0, 0.05 * 0.05});
  }
  return map_T_base;
}

TEST(Localizer, EveryMethodLocalisesTheRobot) {
  for (const std::string& method : localization_methods()) {
    Result<Localizer> localizer = Localizer::make(setup_with(method));
    ASSERT_TRUE(localizer) << method << ": " << to_string(localizer.error());
    EXPECT_FALSE(localizer->estimate()) << method << " has no estimate before the first sample";
    const SE2 truth = drive(*localizer, 60);
    const auto estimate = localizer->estimate();
    ASSERT_TRUE(estimate) << method;
    EXPECT_TRUE(estimate->certain) << method;
    EXPECT_LT((estimate->map_T_base.translation() - truth.translation()).norm(), 0.02) << method;
    EXPECT_NEAR(estimate->map_T_base.yaw(), truth.yaw(), 0.02) << method;
    EXPECT_EQ(localizer->filter() == nullptr, method == "anchor");
    EXPECT_EQ(localizer->smoothed().empty(), method != "smoother") << method;
  }
}

TEST(Localizer, TheFixedLagSmootherReturnsTheRestOfTheRun) {
  LocalizerSetup setup = setup_with("smoother");
  setup.filter.lag_s = 0.5;
  Result<Localizer> localizer = Localizer::make(setup);
  ASSERT_TRUE(localizer) << to_string(localizer.error());
  const SE2 truth = drive(*localizer, 60);
  ASSERT_TRUE(localizer->estimate());
  EXPECT_LE(localizer->estimate()->stamp, at(59 - 9)) << "one lag old";
  const auto end = localizer->smoothed();
  ASSERT_FALSE(end.empty());
  EXPECT_GT(end.front().stamp, localizer->estimate()->stamp) << "only what estimate() has not returned";
  EXPECT_LT((end.back().map_T_base.translation() - truth.translation()).norm(), 0.02);
}

TEST(Localizer, IgnoresSamplesThatAreNotMeasurements) {
  Result<Localizer> plain = Localizer::make(setup_with("riekf"));
  Result<Localizer> mixed = Localizer::make(setup_with("riekf"));
  ASSERT_TRUE(plain && mixed);
  mixed->add(TruthPose{at(0), lift(SE2(5, 5, 1))});
  mixed->add(StampedCommand{at(0), {1, 1}});
  mixed->add(CameraFrame{.stamp = at(0)});
  mixed->add(LaserScan{.stamp = at(0)});
  EXPECT_FALSE(mixed->estimate());
  drive(*plain, 30);
  drive(*mixed, 30);
  mixed->add(TruthPose{at(31), lift(SE2(5, 5, 1))});
  EXPECT_EQ(plain->estimate()->map_T_base.translation(), mixed->estimate()->map_T_base.translation());
  EXPECT_EQ(plain->estimate()->covariance, mixed->estimate()->covariance);
}

TEST(Localizer, ParsesTheNamesOfMethods) {
  for (const std::string& name : localization_methods())
    EXPECT_EQ(to_string(parse_localization_method(name).value()), name);
}

TEST(Localizer, RejectsImpossibleSetups) {
  const auto refused = [](const LocalizerSetup& setup) {
    const auto localizer = Localizer::make(setup);
    EXPECT_FALSE(localizer);
    return localizer ? Error{} : localizer.error();
  };
  const auto typo = parse_localization_method("riek");
  ASSERT_FALSE(typo);
  EXPECT_EQ(typo.error().place.key, "method");
  EXPECT_THAT(typo.error().hint, HasSubstr("riekf"));
  LocalizerSetup empty = setup_with("riekf");
  empty.landmarks = {};
  testing::expect_on_page("localize", refused(empty));
  LocalizerSetup blind = setup_with("anchor");
  blind.sensor.camera = {};
  EXPECT_THAT(refused(blind).hint, HasSubstr("riekf"));
  testing::expect_on_page("localize", refused(blind));
  TagMap twice = wall();
  twice.tags[{FamilyId::Tag36h11, 9}] = twice.tags.at({FamilyId::Tag36h11, 2});
  LocalizerSetup contradicting = setup_with("riekf");
  contradicting.landmarks = Landmarks(twice);
  EXPECT_THAT(refused(contradicting).message, HasSubstr("tag36h11:9"));
  testing::expect_on_page("localize", refused(contradicting));
  LocalizerSetup absurd = setup_with("riekf");
  absurd.filter.camera_latency_s = -1e9;
  EXPECT_EQ(refused(absurd).code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace waymark
