#include "waymark/recording/picture_recording.hpp"

#include <utility>

#include "waymark/codecs/image_codec.hpp"

namespace waymark {
namespace {

constexpr const char* kCompressed = "/image_raw/compressed";
constexpr int kJpegQuality = 92;

}  // namespace

Status record_picture(const CameraFrame& picture, const std::string& how, SampleRecorder& recorder) {
  if (how.empty()) return {};
  if (how == "raw") return recorder.add(picture);
  auto bytes = encode_jpeg(picture.image, kJpegQuality);
  if (!bytes) return tl::unexpected(bytes.error());
  ros2::CompressedImage message;
  message.header = ros2::to_ros(CameraFrame{.stamp = picture.stamp, .camera = picture.camera}).header;
  message.format = "jpeg";
  message.data = std::move(*bytes);
  return recorder.add_message(topic_of_camera(picture.camera, kCompressed), picture.stamp, message);
}

}  // namespace waymark
