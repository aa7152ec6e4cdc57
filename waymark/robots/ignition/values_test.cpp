#include "waymark/robots/ignition/values.hpp"

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

constexpr SensorTime kStamp{std::chrono::nanoseconds(12'345'678'901)};

CameraModel camera() {
  PinholeRadtan lens{.fx = 400, .fy = 410, .cx = 320, .cy = 240};
  lens.k = {0.04, -0.07, 0.001, 0, 0.01};
  lens.coefficients = 5;
  return CameraModel::make(lens, 640, 480).value();
}

std::vector<GazeboValue> one_of_each() {
  CameraFrame frame{.stamp = kStamp, .image = Image(5, 3)};
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 5; ++x) frame.image.row(y)[x] = static_cast<std::uint8_t>(50 * y + x);
  LaserScan scan{.stamp = kStamp, .angle_min_rad = -1, .angle_increment_rad = 0.5, .range_max_m = 8};
  scan.ranges_m = {1, 2, 3};
  return {Odometry{kStamp, SE2(1, -2, 0.5), 0.3, -0.2},
          ImuSample{kStamp, {0.1, 0.2, 0.3}, {0, 0, 9.8}},
          scan,
          frame,
          GamepadState{kStamp, {0.5F, -1}, {0, 1, 1}},
          GazeboCamera{kStamp, camera()},
          GazeboPoses{kStamp, {{"limo", SE3(SO3::from_rpy(0, 0, 1), {1, 2, 0.1})}, {"wall", SE3()}}},
          GazeboClock{kStamp},
          StampedCommand{.command = {0.4, -0.3}}};
}

TEST(GazeboValues, EveryTypeComesBackFromItsMessage) {
  for (const GazeboValue& value : one_of_each()) {
    const auto back = parse_gazebo(type_of(value), serialize_gazebo(value));
    ASSERT_TRUE(back) << type_of(value) << ": " << to_string(back.error());
    ASSERT_EQ(back->index(), value.index()) << type_of(value);
    EXPECT_EQ(serialize_gazebo(*back), serialize_gazebo(value)) << type_of(value);
  }
}

TEST(GazeboValues, TypesAreThoseOfFortress) {
  const std::vector<std::string> types = {
      "ignition.msgs.Odometry", "ignition.msgs.IMU",   "ignition.msgs.LaserScan",
      "ignition.msgs.Image",    "ignition.msgs.Joy",   "ignition.msgs.CameraInfo",
      "ignition.msgs.Pose_V",   "ignition.msgs.Clock", "ignition.msgs.Twist"};
  const auto values = one_of_each();
  for (std::size_t i = 0; i < types.size(); ++i) EXPECT_EQ(type_of(values[i]), types[i]);
}

TEST(GazeboValues, NumbersStandWhereTheyBelong) {
  const auto odometry = parse_gazebo("ignition.msgs.Odometry", serialize_gazebo(one_of_each()[0]));
  const auto& back = std::get<Odometry>(*odometry);
  EXPECT_EQ(back.stamp, kStamp);
  EXPECT_NEAR(back.odom_T_base.y(), -2, 1e-12);
  EXPECT_NEAR(back.odom_T_base.rotation().angle(), 0.5, 1e-12);
  EXPECT_EQ(back.speed_m_s, 0.3);
  EXPECT_EQ(back.yaw_rate_rad_s, -0.2);
}

TEST(GazeboValues, NoBytesWhateverMakeItCrash) {
  EXPECT_FALSE(parse_gazebo("ignition.msgs.StringMsg", ""));
  Random random(20261123);
  const auto values = one_of_each();
  int refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    const GazeboValue& value = values[static_cast<std::size_t>(i) % values.size()];
    std::string bytes = serialize_gazebo(value);
    for (int k = 0; k < 3; ++k)
      bytes[static_cast<std::size_t>(random.uniform() * static_cast<double>(bytes.size()))] =
          static_cast<char>(random.uniform() * 256);
    if (i % 3 == 0)
      bytes.resize(static_cast<std::size_t>(random.uniform() * static_cast<double>(bytes.size())));
    const auto& other =
        values[static_cast<std::size_t>(random.uniform() * static_cast<double>(values.size()))];
    const auto parsed = parse_gazebo(type_of(i % 2 == 0 ? value : other), bytes);
    refused += parsed ? 0 : 1;
  }
  EXPECT_GT(refused, 1000);
}

TEST(GazeboValues, PicturesThatLieAreRefused) {
  EXPECT_FALSE(parse_gazebo("ignition.msgs.Image", ""));
  // A picture of 1000 x 1000 px with three bytes of data: width 2, height 3, step 4, data 5, format 6.
  const std::string lies(
      "\x10\xe8\x07\x18\xe8\x07\x20\xb8\x17\x2a\x03"
      "abc"
      "\x30\x03",
      16);
  const auto image = parse_gazebo("ignition.msgs.Image", lies);
  ASSERT_FALSE(image);
  EXPECT_NE(image.error().message.find("1000 x 1000 px"), std::string::npos) << image.error().message;
}

}  // namespace
}  // namespace waymark
