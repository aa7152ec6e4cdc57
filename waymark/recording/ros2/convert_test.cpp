// Conversion of images, scans, gamepads and tag poses between samples and ROS 2 messages.
#include "waymark/recording/ros2/convert.hpp"

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/codecs/image_codec.hpp"

namespace waymark {
namespace {

CameraModel some_camera() {
  return CameraModel::make(
             PinholeRadtan{
                 .fx = 442.17, .fy = 443.88, .cx = 323.5, .cy = 247, .k = {0.045, -0.077}, .coefficients = 4},
             640, 480)
      .value();
}

// Corners in messages have the order used by apriltag_ros: bottom left first, pixel centres at integers.
TEST(Ros2Convert, CornersMatchAprilTagRos) {
  TagFrame frame;
  TagDetection tag{.tag = {FamilyId::Tag36h11, 7}};
  tag.corners_px = {Eigen::Vector2d(10.5, 20.5), Eigen::Vector2d(30.5, 20.5), Eigen::Vector2d(30.5, 40.5),
                    Eigen::Vector2d(10.5, 40.5)};
  frame.detections = {tag};
  const auto message = ros2::to_ros(frame);
  ASSERT_EQ(message.detections.size(), 1U);
  EXPECT_EQ(message.detections[0].family, "tag36h11");
  EXPECT_EQ(message.detections[0].corners[0].x, 10);  // bottom left
  EXPECT_EQ(message.detections[0].corners[0].y, 40);
  EXPECT_EQ(message.detections[0].corners[3].y, 20);  // top left
  EXPECT_EQ(message.detections[0].centre.x, 20);
}

// x of the tag points to the right, y down, and the border is at 1, as in libapriltag's row-major H.
TEST(Ros2Convert, TheHomographyMapsTheTagSquareToItsCorners) {
  Eigen::Matrix3d px_H_tag;
  px_H_tag << 40, -7, 210, 5, 33, 120, 0.08, -0.05, 1;
  const auto project = [&](double x, double y) -> Eigen::Vector2d {
    return (px_H_tag * Eigen::Vector3d(x, y, 1)).hnormalized();
  };
  const Eigen::Vector2d half(0.5, 0.5);  // ROS pixel centres are at integers
  TagDetection tag;
  tag.corners_px = {project(-1, -1) + half, project(1, -1) + half, project(1, 1) + half,
                    project(-1, 1) + half};
  const auto message = ros2::to_ros(TagFrame{.detections = {tag}});
  for (int i = 0; i < 9; ++i)
    EXPECT_NEAR(message.detections[0].homography[static_cast<std::size_t>(i)], px_H_tag(i / 3, i % 3), 1e-9);
  EXPECT_NEAR(message.detections[0].centre.x, 210, 1e-9) << "the intersection of the diagonals, not the mean";
  EXPECT_NEAR(message.detections[0].centre.y, 120, 1e-9);
  tag.corners_px.fill({3, 4});
  const auto none = ros2::to_ros(TagFrame{.detections = {tag}});
  EXPECT_EQ(none.detections[0].homography, (std::array<double, 9>{}));
  EXPECT_EQ(none.detections[0].centre.x, 2.5);
}

TEST(Ros2Convert, CameraInfoHasCentresAtIntegers) {
  const auto info = ros2::to_ros(some_camera(), SensorTime{});
  EXPECT_DOUBLE_EQ(info.k[2], 323.0);
  EXPECT_DOUBLE_EQ(info.k[5], 246.5);
  EXPECT_EQ(info.distortion_model, "plumb_bob");
  EXPECT_EQ(info.d.size(), 5U);
}

TEST(Ros2Convert, CameraInfoDescribesTheImagesThatAreSent) {
  auto info = ros2::to_ros(some_camera(), SensorTime{});
  EXPECT_EQ(ros2::from_ros(info).value().width_px(), 640);
  info.binning_x = info.binning_y = 2;
  const auto binned = ros2::from_ros(info);
  ASSERT_TRUE(binned) << to_string(binned.error());
  const CameraModel full = ros2::from_ros(ros2::to_ros(some_camera(), SensorTime{})).value();
  EXPECT_EQ(binned.value(), scaled_camera(full, 320, 240).value());
  info = ros2::to_ros(some_camera(), SensorTime{});
  info.roi = {.x_offset = 40, .y_offset = 20, .height = 400, .width = 500};
  const Eigen::Vector3d p(0.1, 0.2, 1);
  const Eigen::Vector2d moved = *some_camera().project(p) - Eigen::Vector2d(40, 20);
  EXPECT_LT((*ros2::from_ros(info)->project(p) - moved).norm(), 1e-9);
  info.d.assign(14, 0.0);
  info.d.back() = 0.1;
  EXPECT_FALSE(ros2::from_ros(info));
}

TEST(Ros2Convert, StampsBeforeAndAfterTheEpochRoundTrip) {
  for (const std::int64_t ns :
       {0LL, 1LL, 999'999'999LL, 1'700'000'000'123'456'789LL, -1LL, -1'000'000'001LL}) {
    EXPECT_EQ(ros2::from_ros(ros2::to_ros(SensorTime(Duration(ns)))).time_since_epoch().count(), ns);
  }
}

Image some_image(int width, int height) {
  Random random(7);
  Image image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<std::uint8_t>(random.index(256));
  return image;
}

ros2::Image one_pixel(const std::string& encoding, Bytes pixel) {
  ros2::Image message{.height = 1, .width = 1, .encoding = encoding};
  message.step = static_cast<std::uint32_t>(pixel.size());
  message.data = std::move(pixel);
  return message;
}

// Rec. 601 luma of (R 200, G 100, B 50): (299*200 + 587*100 + 114*50) / 1000 = 124.2.
TEST(Ros2Convert, ConvertsEveryEncodingToGrey) {
  const std::vector<std::pair<ros2::Image, int>> cases = {
      {one_pixel("mono8", {77}), 77},
      {one_pixel("rgb8", {200, 100, 50}), 124},
      {one_pixel("bgr8", {50, 100, 200}), 124},
      {one_pixel("rgba8", {200, 100, 50, 0}), 124},
      {one_pixel("bgra8", {50, 100, 200, 255}), 124},
      {one_pixel("mono16", {0xFF, 0xFF}), 255},
      {one_pixel("mono16", {0x00, 0x80}), 128},
      {one_pixel("yuv422", {9, 55}), 55},
      {one_pixel("yuv422_yuy2", {55, 9}), 55},
      {one_pixel("uyvy", {9, 55}), 55},
      {one_pixel("yuyv", {55, 9}), 55},
      {one_pixel("nv12", {55, 9}), 55},
      {one_pixel("8UC4", {50, 100, 200, 0}), 124},
  };
  for (const auto& [message, grey] : cases) {
    const auto frame = ros2::from_ros(message);
    ASSERT_TRUE(frame) << message.encoding << ": " << to_string(frame.error());
    EXPECT_EQ(frame->image.row(0)[0], grey) << message.encoding;
  }
  ros2::Image big = one_pixel("mono16", {0x80, 0x00});
  big.is_bigendian = 1;
  EXPECT_EQ(ros2::from_ros(big)->image.row(0)[0], 128);
}

TEST(Ros2Convert, RowsMayBePaddedExceptTheLast) {
  ros2::Image message{.height = 2, .width = 2, .encoding = "mono8", .step = 5, .data = {1, 2, 0, 0, 0, 3, 4}};
  const auto frame = ros2::from_ros(message);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->image.row(1)[0], 3);
  EXPECT_EQ(frame->image.row(1)[1], 4);
}

TEST(Ros2Convert, RejectsInconsistentImages) {
  const ros2::Image sound{.height = 2, .width = 2, .encoding = "mono8", .step = 2, .data = {1, 2, 3, 4}};
  ASSERT_TRUE(ros2::from_ros(sound));
  ros2::Image message = sound;
  message.data.pop_back();
  EXPECT_EQ(ros2::from_ros(message).error().code, ErrorCode::Unreadable);
  message = sound;
  message.step = 1;
  EXPECT_FALSE(ros2::from_ros(message));
  message = sound;
  message.height = 0xFFFFFFFF;
  message.step = 0xFFFFFFFF;
  EXPECT_FALSE(ros2::from_ros(message));
  message = sound;
  message.width = 0;
  EXPECT_FALSE(ros2::from_ros(message));
  message = sound;
  message.encoding = "bayer_rggb4";
  EXPECT_EQ(ros2::from_ros(message).error().code, ErrorCode::Unsupported);
}

TEST(Ros2Convert, DecodesCompressedImages) {
  const Image image = some_image(20, 10);
  const auto png = encode_png(image);
  const auto frame = ros2::from_ros(ros2::CompressedImage{.format = "mono8; png compressed ", .data = *png});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->image, image);
  const auto jpeg = encode_jpeg(Image(16, 16, 90), 95);
  EXPECT_NEAR(ros2::from_ros(ros2::CompressedImage{.format = "jpeg", .data = *jpeg})->image.row(5)[5], 90, 1);
  EXPECT_FALSE(ros2::from_ros(ros2::CompressedImage{.format = "jpeg", .data = {1, 2, 3}}));
}

TEST(Ros2Convert, CameraFramesRoundTrip) {
  for (const std::string camera : {"cam", "left", "cam_2"})
    EXPECT_EQ(ros2::camera_of_frame(ros2::camera_frame(camera)), camera);
  EXPECT_EQ(ros2::camera_frame("cam"), "camera_optical");
  EXPECT_EQ(ros2::camera_of_frame(""), "cam");
  EXPECT_EQ(ros2::camera_of_frame("usb_cam"), "usb_cam");
}

}  // namespace
}  // namespace waymark
