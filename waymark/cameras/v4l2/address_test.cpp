#include "waymark/cameras/v4l2/address.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

TEST(V4l2Address, ParsesDeviceAndOptions) {
  const auto options =
      parse_v4l2_address("v4l2:/dev/v4l/by-id/a,size=1280x720,rate=30,format=MJPG,exposure_ms=5,lock");
  ASSERT_TRUE(options);
  EXPECT_EQ(options->device, "/dev/v4l/by-id/a");
  EXPECT_EQ(options->width, 1280);
  EXPECT_EQ(options->height, 720);
  EXPECT_EQ(options->rate_hz, 30);
  EXPECT_EQ(options->format, PixelFormat::Mjpg);
  EXPECT_TRUE(options->lock);
  EXPECT_EQ(options->controls.at("exposure_ms"), 5);
  EXPECT_EQ(parse_v4l2_address("v4l2:2")->device, "/dev/video2");
  for (const char* wrong : {"v4l2:", "v4l2:0,size=1280", "v4l2:0,format=RGB", "v4l2:0,rate=0", "v4l2:0,fast",
                            "v4l2:0,gain=much", "v4l2:0,rate=nan", "v4l2:0,size=-1x2"})
    testing::expect_on_page("cameras", parse_v4l2_address(wrong).error());
}

}  // namespace
}  // namespace waymark
