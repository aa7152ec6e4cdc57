#include "waymark/robots/ignition/pictures.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/recording/ros2/convert.hpp"
#include "waymark/robots/ignition/headers.hpp"

namespace waymark {
namespace {

/// As ROS calls a format; empty: not read.
std::string encoding_of(ignition::msgs::PixelFormatType format) {
  switch (format) {
    case ignition::msgs::L_INT8:
      return "mono8";
    case ignition::msgs::L_INT16:
      return "mono16";
    case ignition::msgs::RGB_INT8:
      return "rgb8";
    case ignition::msgs::BGR_INT8:
      return "bgr8";
    case ignition::msgs::RGBA_INT8:
      return "rgba8";
    case ignition::msgs::BGRA_INT8:
      return "bgra8";
    default:
      return {};
  }
}

/// Fills an array of a message as far as both reach.
template <class From, class To>
void copy_numbers(const From& from, To& to) {
  std::copy_n(from.begin(), std::min<std::size_t>(to.size(), static_cast<std::size_t>(from.size())),
              to.begin());
}

}  // namespace

Result<CameraFrame> from_ignition(const ignition::msgs::Image& message) {
  const std::string encoding = encoding_of(message.pixel_format_type());
  if (encoding.empty())
    return fail(ErrorCode::Unsupported,
                fmt::format("pictures in the format {} cannot be read",
                            ignition::msgs::PixelFormatType_Name(message.pixel_format_type())),
                {}, "Give the camera <format>R8G8B8</format> or <format>L8</format>.");
  const std::string& data = message.data();
  return ros2::from_ros(ros2::Image{.header = {ros2::to_ros(from_ignition(message.header().stamp())), ""},
                                    .height = message.height(),
                                    .width = message.width(),
                                    .encoding = encoding,
                                    .is_bigendian = 0,
                                    .step = message.step(),
                                    .data = {data.begin(), data.end()}});
}

ignition::msgs::Image to_ignition(const CameraFrame& frame) {
  constexpr std::size_t kChannels = 3;
  const Image& image = frame.image;
  ignition::msgs::Image message;
  *message.mutable_header() = header(frame.stamp, frame.camera);
  message.set_width(static_cast<std::uint32_t>(image.width()));
  message.set_height(static_cast<std::uint32_t>(image.height()));
  message.set_step(static_cast<std::uint32_t>(image.width()) * kChannels);
  message.set_pixel_format_type(ignition::msgs::RGB_INT8);
  std::string& data = *message.mutable_data();
  data.reserve(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()) *
               kChannels);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) data.append(kChannels, static_cast<char>(image.row(y)[x]));
  return message;
}

Result<GazeboCamera> from_ignition(const ignition::msgs::CameraInfo& message) {
  if (message.distortion().model() != ignition::msgs::CameraInfo::Distortion::PLUMB_BOB)
    return fail(ErrorCode::Unsupported, "its distortion is not of the model PLUMB_BOB");
  ros2::CameraInfo info{.height = message.height(),
                        .width = message.width(),
                        .distortion_model = "plumb_bob",
                        .d = {message.distortion().k().begin(), message.distortion().k().end()}};
  copy_numbers(message.intrinsics().k(), info.k);
  copy_numbers(message.projection().p(), info.p);
  copy_numbers(message.rectification_matrix(), info.r);
  const auto camera = ros2::from_ros(info);
  if (!camera) return tl::unexpected(camera.error());
  return GazeboCamera{from_ignition(message.header().stamp()), *camera};
}

ignition::msgs::CameraInfo to_ignition(const GazeboCamera& camera) {
  const ros2::CameraInfo info = ros2::to_ros(camera.camera, camera.stamp);
  ignition::msgs::CameraInfo message;
  *message.mutable_header() = header(camera.stamp, "camera");
  message.set_width(info.width);
  message.set_height(info.height);
  message.mutable_distortion()->mutable_k()->Add(info.d.begin(), info.d.end());
  message.mutable_intrinsics()->mutable_k()->Add(info.k.begin(), info.k.end());
  message.mutable_projection()->mutable_p()->Add(info.p.begin(), info.p.end());
  message.mutable_rectification_matrix()->Add(info.r.begin(), info.r.end());
  return message;
}

}  // namespace waymark
