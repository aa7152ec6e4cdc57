#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/recording/ros2_convert.hpp"

namespace waymark::ros2 {
namespace {

constexpr std::string_view kOpticalSuffix = "_optical";

/// How the bytes of a pixel make grey.
struct PixelLayout {
  std::string_view encoding;
  int bytes = 1;
  enum class Kind : std::uint8_t { Grey8, Grey16, Colour } kind = Kind::Grey8;
  int first = 0;  ///< of Grey8: the byte that is grey; of Colour: the byte that is red
  int blue = 0;   ///< of Colour
};

using Kind = PixelLayout::Kind;
constexpr PixelLayout kLayouts[] = {
    {"mono8", 1},
    {"8UC1", 1},
    {"mono16", 2, Kind::Grey16},
    {"16UC1", 2, Kind::Grey16},
    {"rgb8", 3, Kind::Colour, 0, 2},
    {"bgr8", 3, Kind::Colour, 2, 0},
    {"8UC3", 3, Kind::Colour, 2, 0},
    {"rgba8", 4, Kind::Colour, 0, 2},
    {"bgra8", 4, Kind::Colour, 2, 0},
    {"yuv422", 2, Kind::Grey8, 1},       // U Y V Y
    {"yuv422_yuy2", 2, Kind::Grey8, 0},  // Y U Y V
};

std::uint8_t grey16(const std::uint8_t* pixel, bool big_endian) {
  const unsigned value = big_endian ? pixel[0] * 256U + pixel[1] : pixel[1] * 256U + pixel[0];
  return static_cast<std::uint8_t>((value * 255U + 32767U) / 65535U);
}

std::uint8_t luma(unsigned r, unsigned g, unsigned b) {
  return static_cast<std::uint8_t>((299U * r + 587U * g + 114U * b + 500U) / 1000U);
}

void fill_row(const PixelLayout& layout, bool big_endian, const std::uint8_t* from, std::uint8_t* to,
              int width) {
  for (int x = 0; x < width; ++x, from += layout.bytes) {
    switch (layout.kind) {
      case Kind::Grey8:
        to[x] = from[layout.first];
        break;
      case Kind::Grey16:
        to[x] = grey16(from, big_endian);
        break;
      case Kind::Colour:
        to[x] = luma(from[layout.first], from[1], from[layout.blue]);
        break;
    }
  }
}

Result<const PixelLayout*> layout_of(const Image& message) {
  for (const PixelLayout& layout : kLayouts) {
    if (layout.encoding == message.encoding) return &layout;
  }
  return fail(
      ErrorCode::Unsupported, fmt::format("pictures with the encoding '{}' cannot be read", message.encoding),
      {.key = "encoding"},
      "Known: mono8, mono16, rgb8, bgr8, rgba8, bgra8, yuv422, yuv422_yuy2 and compressed JPEG or PNG.");
}

}  // namespace

std::string camera_frame(std::string_view camera) {
  return camera == "cam" ? std::string(kCameraFrame) : fmt::format("{}{}", camera, kOpticalSuffix);
}

std::string camera_of_frame(std::string_view frame) {
  if (frame.empty() || frame == kCameraFrame) return "cam";
  if (frame.size() > kOpticalSuffix.size() && frame.ends_with(kOpticalSuffix))
    frame.remove_suffix(kOpticalSuffix.size());
  return std::string(frame);
}

Image to_ros(const CameraFrame& frame) {
  const waymark::Image& image = frame.image;
  Image message{.header = {to_ros(frame.stamp), camera_frame(frame.camera)},
                .height = static_cast<std::uint32_t>(image.height()),
                .width = static_cast<std::uint32_t>(image.width()),
                .encoding = "mono8",
                .step = static_cast<std::uint32_t>(image.width())};
  if (!image.empty()) {
    const std::uint8_t* pixels = image.row(0);
    message.data.assign(pixels, pixels + std::size_t{message.step} * message.height);
  }
  return message;
}

Result<CameraFrame> from_ros(const Image& message) {
  const Result<const PixelLayout*> layout = layout_of(message);
  if (!layout) return tl::unexpected(layout.error());
  constexpr std::uint32_t kMostSide = 1U << 20U;
  const std::uint64_t row = std::uint64_t{message.width} * static_cast<unsigned>((*layout)->bytes);
  const std::uint64_t needed =
      message.height == 0 ? 0 : std::uint64_t{message.step} * (message.height - 1) + row;
  const bool sound = message.width > 0 && message.height > 0 && message.width <= kMostSide &&
                     message.height <= kMostSide && message.step >= row && message.data.size() >= needed;
  if (!sound) {
    return fail(ErrorCode::Unreadable,
                fmt::format("a picture of {} x {} px in {} with {} bytes a row and {} in all", message.width,
                            message.height, message.encoding, message.step, message.data.size()));
  }
  CameraFrame frame{
      .stamp = from_ros(message.header.stamp),
      .camera = camera_of_frame(message.header.frame_id),
      .image = waymark::Image(static_cast<int>(message.width), static_cast<int>(message.height))};
  for (int y = 0; y < frame.image.height(); ++y) {
    fill_row(**layout, message.is_bigendian != 0,
             message.data.data() + std::size_t{message.step} * static_cast<std::size_t>(y),
             frame.image.row(y), frame.image.width());
  }
  return frame;
}

Result<CameraFrame> from_ros(const CompressedImage& message) {
  Result<waymark::Image> image = decode_image(message.data, "a compressed picture");
  if (!image) return tl::unexpected(image.error());
  return CameraFrame{.stamp = from_ros(message.header.stamp),
                     .camera = camera_of_frame(message.header.frame_id),
                     .image = std::move(*image)};
}

LaserScan to_ros(const waymark::LaserScan& scan) {
  const double last = scan.ranges_m.empty() ? 0.0 : static_cast<double>(scan.ranges_m.size() - 1);
  return {.header = {to_ros(scan.stamp), std::string(kLaserFrame)},
          .angle_min = static_cast<float>(scan.angle_min_rad),
          .angle_max = static_cast<float>(scan.angle_min_rad + last * scan.angle_increment_rad),
          .angle_increment = static_cast<float>(scan.angle_increment_rad),
          .time_increment = static_cast<float>(scan.time_increment_s),
          .range_min = static_cast<float>(scan.range_min_m),
          .range_max = static_cast<float>(scan.range_max_m),
          .ranges = scan.ranges_m};
}

waymark::LaserScan from_ros(const LaserScan& message) {
  return {.stamp = from_ros(message.header.stamp),
          .angle_min_rad = message.angle_min,
          .angle_increment_rad = message.angle_increment,
          .time_increment_s = message.time_increment,
          .range_min_m = message.range_min,
          .range_max_m = message.range_max,
          .ranges_m = message.ranges};
}

Joy to_ros(const GamepadState& state) {
  return {.header = {to_ros(state.stamp), ""}, .axes = state.axes, .buttons = state.buttons};
}

GamepadState from_ros(const Joy& message) {
  return {.stamp = from_ros(message.header.stamp), .axes = message.axes, .buttons = message.buttons};
}

RangeBearing to_ros(const waymark::RangeBearing& sample) {
  return {.header = {to_ros(sample.stamp), std::string(kLaserFrame)},
          .landmark = sample.landmark,
          .range_m = sample.range_m,
          .bearing_rad = sample.bearing_rad};
}

waymark::RangeBearing from_ros(const RangeBearing& message) {
  return {from_ros(message.header.stamp), message.landmark, message.range_m, message.bearing_rad};
}

TagPoseArray to_ros(const TagPoseFrame& frame) {
  TagPoseArray message{.header = {to_ros(frame.stamp), camera_frame(frame.camera)}};
  for (const SeenTagPose& seen : frame.tags)
    message.tags.push_back(
        {std::string(to_string(seen.tag.family)), seen.tag.number, to_ros(seen.cam_T_tag)});
  return message;
}

Result<TagPoseFrame> from_ros(const TagPoseArray& message) {
  TagPoseFrame frame{.stamp = from_ros(message.header.stamp),
                     .camera = camera_of_frame(message.header.frame_id)};
  for (const TagPose& in : message.tags) {
    const Result<FamilyId> family = parse_family(in.family);
    if (!family) return tl::unexpected(family.error());
    frame.tags.push_back({.tag = {*family, in.id}, .cam_T_tag = from_ros(in.pose)});
  }
  return frame;
}

}  // namespace waymark::ros2
