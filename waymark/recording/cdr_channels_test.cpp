#include "waymark/recording/cdr_channels.hpp"

#include <gtest/gtest.h>

#include "waymark/recording/ros2/messages.hpp"

namespace waymark {
namespace {

constexpr std::string_view kHeader =
    "================================================================================\n"
    "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

TEST(Ros1Transcoder, PadsAsCdrRequires) {
  const auto transcoder = ros::Ros1Transcoder::make(
      "pkg/Type", "uint8 a\nfloat64 b\nstring s\nint16[] c\nfloat64[] none\nbool e\n");
  ASSERT_TRUE(transcoder);
  const Bytes ros1 = {7,   0, 0, 0, 0, 0, 0, 0xF0, 0x3F, 2, 0, 0, 0, 'h',
                      'i', 2, 0, 0, 0, 1, 0, 2,    0,    0, 0, 0, 0, 1};
  Bytes cdr;
  ASSERT_TRUE(transcoder->transcode(ros1, cdr));
  const Bytes expected = {0, 1, 0, 0,   7,   0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xF0, 0x3F, 3,
                          0, 0, 0, 'h', 'i', 0, 0, 2, 0, 0, 0, 1, 0, 2, 0, 0, 0, 0, 0,    1};
  EXPECT_EQ(cdr, expected);
  for (std::size_t size = 0; size < ros1.size(); ++size) {
    Bytes out;
    EXPECT_FALSE(transcoder->transcode(ByteSpan(ros1).first(size), out)) << size;
  }
  Bytes longer = ros1;
  longer.push_back(0);
  EXPECT_FALSE(transcoder->transcode(longer, cdr));
}

// Repeated empty structs consume no input, so the output must be bounded separately.
TEST(Ros1Transcoder, RepeatedEmptyStructsAreBounded) {
  std::string text = "A[10000000] a\n";
  for (const char* name : {"A", "B", "C"})
    text += std::string("====================\nMSG: pkg/") + name + "\n" +
            (*name == 'C' ? "int8[0] z\n" : std::string(1, static_cast<char>(*name + 1)) + "[10000000] x\n");
  const auto transcoder = ros::Ros1Transcoder::make("pkg/Type", text);
  ASSERT_TRUE(transcoder) << to_string(transcoder.error());
  Bytes cdr;
  EXPECT_FALSE(transcoder->transcode({}, cdr));
  EXPECT_LT(cdr.size(), std::size_t{1} << 20);
}

TEST(Ros1Transcoder, KnownTypesGetRos2Names) {
  const auto info = ros::Ros1Transcoder::make(
      "sensor_msgs/CameraInfo",
      "Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\nfloat64[9] "
      "K\nfloat64[9] R\n"
      "float64[12] P\nuint32 binning_x\nuint32 binning_y\nRegionOfInterest roi\n" +
          std::string(kHeader) +
          "================================================================================\nMSG: "
          "sensor_msgs/RegionOfInterest\n"
          "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n");
  ASSERT_TRUE(info) << to_string(info.error());
  EXPECT_TRUE(info->same_as_ros2());
  EXPECT_EQ(info->schema(), ros2::schema_text(ros2::CameraInfo::kType));
  const auto other = ros::Ros1Transcoder::make("nav_msgs/Odometry", "float64 x\n");
  ASSERT_TRUE(other);
  EXPECT_FALSE(other->same_as_ros2());
}

}  // namespace
}  // namespace waymark
