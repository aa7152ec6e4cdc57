// Tests timestamps, frames, poses and images in valid and invalid Gazebo messages.
#include "waymark/robots/ignition/values.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

TEST(IgnitionHeaders, StampsRoundTripToTheNanosecond) {
  for (const std::int64_t ns : {std::int64_t{0}, std::int64_t{1}, std::int64_t{999'999'999},
                                std::int64_t{1'700'000'000'123'456'789}}) {
    const SensorTime stamp{Duration(ns)};
    EXPECT_EQ(from_ignition(to_ignition(stamp)), stamp) << ns;
  }
  ignition::msgs::Time hostile;
  for (const std::int64_t sec :
       {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()}) {
    hostile.set_sec(sec);
    EXPECT_EQ(from_ignition(hostile), SensorTime()) << "no overflow";
  }
}

TEST(IgnitionHeaders, ContainFramesByKeyAndOmitEmptyOnes) {
  const auto both = header(SensorTime(std::chrono::seconds(3)), "odom", "base_link");
  EXPECT_EQ(header_value(both, "frame_id"), "odom");
  EXPECT_EQ(header_value(both, "child_frame_id"), "base_link");
  EXPECT_EQ(header_value(both, "seq"), "");
  EXPECT_EQ(header(SensorTime(), "").data_size(), 0);
  auto hollow = both;
  hollow.mutable_data(0)->clear_value();
  EXPECT_EQ(header_value(hollow, "frame_id"), "") << "a key without a value";
}

TEST(IgnitionHeaders, PosesRoundTripAndInvalidRotationsAreRejected) {
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const SE3 pose(SO3::exp({random.normal(), random.normal(), random.normal()}), {random.normal(), -2, 7});
    const auto back = from_ignition(to_ignition(pose));
    ASSERT_TRUE(back);
    EXPECT_LT((back->matrix() - pose.matrix()).norm(), 1e-12);
  }
  auto zero = to_ignition(SE3());
  zero.mutable_orientation()->set_w(0);
  EXPECT_FALSE(from_ignition(zero));
  zero.mutable_orientation()->set_w(std::nan(""));
  EXPECT_FALSE(from_ignition(zero));
  ignition::msgs::Pose place;
  place.mutable_position()->set_x(4);
  const auto level = from_ignition(place);
  ASSERT_TRUE(level) << "a missing orientation is the identity";
  EXPECT_EQ(level->translation().x(), 4);
}

TEST(IgnitionImages, EverySupportedFormatConvertsToGrey) {
  using ignition::msgs::PixelFormatType;
  const std::vector<std::pair<PixelFormatType, std::string>> one_grey = {
      {ignition::msgs::L_INT8, std::string(1, '\x50')},
      {ignition::msgs::RGB_INT8, std::string(3, '\x50')},
      {ignition::msgs::BGR_INT8, std::string(3, '\x50')},
      {ignition::msgs::RGBA_INT8, std::string(4, '\x50')},
      {ignition::msgs::BGRA_INT8, std::string(4, '\x50')}};
  for (const auto& [format, pixel] : one_grey) {
    ignition::msgs::Image message;
    message.set_width(3);
    message.set_height(2);
    message.set_step(static_cast<std::uint32_t>(3 * pixel.size()));
    message.set_pixel_format_type(format);
    for (int i = 0; i < 6; ++i) message.mutable_data()->append(pixel);
    const auto frame = from_ignition(message);
    ASSERT_TRUE(frame) << ignition::msgs::PixelFormatType_Name(format) << ": " << to_string(frame.error());
    for (int y = 0; y < 2; ++y)
      for (int x = 0; x < 3; ++x) EXPECT_NEAR(frame->image.row(y)[x], 0x50, 1);
    message.mutable_data()->resize(message.data().size() - 1);
    EXPECT_FALSE(from_ignition(message)) << "one byte is missing";
  }
  ignition::msgs::Image depth;
  depth.set_pixel_format_type(ignition::msgs::R_FLOAT32);
  const auto refused = from_ignition(depth);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().hint.find("R8G8B8"), std::string::npos)
      << "the hint contains the format to set in the world";
  testing::expect_on_page("robots", refused.error());
}

TEST(IgnitionImages, RejectsOtherDistortionModels) {
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 400, .fy = 410, .cx = 320, .cy = 240}, 640, 480).value();
  auto message = to_ignition(GazeboCamera{SensorTime(), camera});
  const auto back = from_ignition(message);
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_LT((*back->camera.project({0.1, 0.2, 1}) - *camera.project({0.1, 0.2, 1})).norm(), 1e-9);
  message.mutable_distortion()->set_model(ignition::msgs::CameraInfo::Distortion::EQUIDISTANT);
  EXPECT_FALSE(from_ignition(message));
}

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

TEST(GazeboValues, EveryTypeRoundTrips) {
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

TEST(GazeboValues, OdometryKeepsItsValues) {
  const auto odometry = parse_gazebo("ignition.msgs.Odometry", serialize_gazebo(one_of_each()[0]));
  const auto& back = std::get<Odometry>(*odometry);
  EXPECT_EQ(back.stamp, kStamp);
  EXPECT_NEAR(back.odom_T_base.y(), -2, 1e-12);
  EXPECT_NEAR(back.odom_T_base.rotation().angle(), 0.5, 1e-12);
  EXPECT_EQ(back.speed_m_s, 0.3);
  EXPECT_EQ(back.yaw_rate_rad_s, -0.2);
}

TEST(GazeboValues, DamagedMessagesAreReadOrRejected) {
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

TEST(GazeboValues, RejectsImagesWithTooLittleData) {
  EXPECT_FALSE(parse_gazebo("ignition.msgs.Image", ""));
  // An image of 1000 x 1000 px with only three bytes of data. Field numbers: width 2, height 3, step 4, data
  // 5, format 6.
  const std::string truncated(
      "\x10\xe8\x07\x18\xe8\x07\x20\xb8\x17\x2a\x03"
      "abc"
      "\x30\x03",
      16);
  const auto image = parse_gazebo("ignition.msgs.Image", truncated);
  ASSERT_FALSE(image);
  EXPECT_NE(image.error().message.find("1000 x 1000 px"), std::string::npos) << image.error().message;
}

}  // namespace
}  // namespace waymark
