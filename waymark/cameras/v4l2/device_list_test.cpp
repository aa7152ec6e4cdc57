#include "waymark/cameras/v4l2/device_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/fake_camera.hpp"
#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using waymark::testing::FakeCamera;

constexpr int kWidth = 64;

constexpr int kHeight = 48;

/// Uniform grey images with levels `first`, `first` + 1, …, so that any pixel identifies the image.
std::vector<std::uint8_t> levels(int count, int first = 50) {
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < count; ++i)
    bytes.insert(bytes.end(), std::size_t{kWidth} * kHeight, static_cast<std::uint8_t>(first + i));
  return bytes;
}

TEST(V4l2Camera, ListsDevicesWithTheirModes) {
  FakeCamera fake;
  EXPECT_TRUE(list_cameras().empty());
  fake.add_mode("YUYV", kWidth, kHeight, 30, levels(2));
  fake.add_mode("H264", kWidth, kHeight, 60, levels(2));
  const auto cameras = list_cameras();
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(cameras[0].path, "/dev/video0");
  EXPECT_EQ(cameras[0].card, "Fake camera");
  ASSERT_EQ(cameras[0].modes.size(), 2U);
  EXPECT_THAT(cameras[0].modes[0].rates_hz, ElementsAre(30));
  EXPECT_FALSE(cameras[0].modes[1].readable);
}

TEST(V4l2Modes, ADeviceOfAnySizeHasTheRequestedOrTheCurrentSize) {
  const std::vector<CameraMode> modes = {
      {.format = "BGR3", .readable = false, .width = 4096, .height = 2160, .largest = true},
      {.format = "YUYV", .width = 4096, .height = 2160, .largest = true, .min_width = 16, .min_height = 16},
      {.format = "GREY", .width = 4096, .height = 2160, .largest = true, .min_width = 16, .min_height = 16}};
  const internal::WantedMode now{.width = 1280, .height = 720};
  const auto as_now = internal::choose_mode(modes, {}, now);
  ASSERT_TRUE(as_now) << to_string(as_now.error());
  EXPECT_EQ(*as_now, (internal::WantedMode{PixelFormat::Grey, 1280, 720, 0}));
  const auto asked = internal::choose_mode(
      modes, {.width = 640, .height = 480, .rate_hz = 30, .format = PixelFormat::Yuyv}, now);
  ASSERT_TRUE(asked) << to_string(asked.error());
  EXPECT_EQ(*asked, (internal::WantedMode{PixelFormat::Yuyv, 640, 480, 30}));
  const auto too_large = internal::choose_mode(modes, {.width = 8192, .height = 4320}, now);
  ASSERT_FALSE(too_large);
  EXPECT_THAT(to_string(too_large.error()), HasSubstr("YUYV up to 4096x2160, GREY up to 4096x2160"));
  testing::expect_on_page("cameras", too_large.error());
}

// A webcam whose current uncompressed size is not available in the requested format.
TEST(V4l2Modes, WithoutASizeChoosesTheNearestOfTheFormat) {
  const std::vector<CameraMode> modes = {
      {.format = "YUYV", .width = 640, .height = 480, .rates_hz = {30}},
      {.format = "MJPG", .width = 1920, .height = 1080, .rates_hz = {30}},
      {.format = "MJPG", .width = 800, .height = 600, .rates_hz = {15}},
      {.format = "GREY", .width = 4096, .height = 2160, .largest = true, .min_width = 16, .min_height = 16}};
  const internal::WantedMode now{.width = 640, .height = 480};
  const auto chosen = [&](const V4l2Options& options, const internal::WantedMode& size) {
    const auto mode = internal::choose_mode(modes, options, size);
    EXPECT_TRUE(mode) << to_string(mode.error());
    return mode.value_or(internal::WantedMode{});
  };
  EXPECT_EQ(chosen({.format = PixelFormat::Mjpg}, now),
            (internal::WantedMode{PixelFormat::Mjpg, 800, 600, 15}));
  EXPECT_EQ(chosen({.format = PixelFormat::Yuyv}, {.width = 1280, .height = 720}),
            (internal::WantedMode{PixelFormat::Yuyv, 640, 480, 30}));
  EXPECT_EQ(chosen({.format = PixelFormat::Grey}, {.width = 8000, .height = 8}),
            (internal::WantedMode{PixelFormat::Grey, 4096, 16, 0}));
  EXPECT_FALSE(internal::choose_mode(modes, {.width = 640, .height = 480, .format = PixelFormat::Mjpg}, now));
}

TEST(V4l2Modes, TheHintCutsALongListAndOmitsUnsupportedFormats) {
  std::vector<CameraMode> modes(300, {.format = "YUYV", .width = 640, .height = 480});
  modes.push_back({.format = "HSV4", .readable = false, .width = 1, .height = 1});
  const auto none = internal::choose_mode(modes, {.width = 320, .height = 240}, {});
  ASSERT_FALSE(none);
  EXPECT_LT(none.error().hint.size(), 400U);
  EXPECT_THAT(none.error().hint, HasSubstr("`waymark cameras`"));
  EXPECT_THAT(none.error().hint, ::testing::Not(HasSubstr("HSV4")));
}

}  // namespace
}  // namespace waymark
