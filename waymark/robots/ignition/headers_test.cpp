// Stamps, frames, poses and pictures of Gazebo's messages, sound and not.
#include "waymark/robots/ignition/headers.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/robots/ignition/pictures.hpp"

namespace waymark {
namespace {

TEST(IgnitionHeaders, AStampComesBackToTheNanosecond) {
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

TEST(IgnitionHeaders, FramesAreFoundByTheirKeysAndEmptyOnesAreNotSent) {
  const auto both = header(SensorTime(std::chrono::seconds(3)), "odom", "base_link");
  EXPECT_EQ(header_value(both, "frame_id"), "odom");
  EXPECT_EQ(header_value(both, "child_frame_id"), "base_link");
  EXPECT_EQ(header_value(both, "seq"), "");
  EXPECT_EQ(header(SensorTime(), "").data_size(), 0);
  auto hollow = both;
  hollow.mutable_data(0)->clear_value();
  EXPECT_EQ(header_value(hollow, "frame_id"), "") << "a key without a value";
}

TEST(IgnitionHeaders, APoseComesBackAndWhatIsNoRotationIsRefused) {
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
  ASSERT_TRUE(level) << "an orientation that was not sent is none";
  EXPECT_EQ(level->translation().x(), 4);
}

TEST(IgnitionPictures, EveryFormatThatIsReadGivesTheGreyOfItsPixels) {
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
    EXPECT_FALSE(from_ignition(message)) << "a byte is missing";
  }
  ignition::msgs::Image depth;
  depth.set_pixel_format_type(ignition::msgs::R_FLOAT32);
  const auto refused = from_ignition(depth);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().hint.find("R8G8B8"), std::string::npos) << "what to write into the world";
}

TEST(IgnitionPictures, ACameraOfAnotherDistortionIsRefused) {
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 400, .fy = 410, .cx = 320, .cy = 240}, 640, 480).value();
  auto message = to_ignition(GazeboCamera{SensorTime(), camera});
  const auto back = from_ignition(message);
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_LT((*back->camera.project({0.1, 0.2, 1}) - *camera.project({0.1, 0.2, 1})).norm(), 1e-9);
  message.mutable_distortion()->set_model(ignition::msgs::CameraInfo::Distortion::EQUIDISTANT);
  EXPECT_FALSE(from_ignition(message));
}

}  // namespace
}  // namespace waymark
