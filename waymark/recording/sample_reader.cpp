#include "waymark/recording/sample_reader.hpp"

#include "waymark/recording/cdr.hpp"
#include "waymark/recording/ros2_convert.hpp"
#include "waymark/recording/ros2_sound.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

std::string_view type_of(const mcap::Index& index, const mcap::Channel& channel) {
  const auto schema = index.schemas.find(channel.schema_id);
  return schema == index.schemas.end() ? std::string_view() : schema->second.name;
}

}  // namespace

Status add_to_setup(RecordingSetup& setup, std::string_view type, ByteSpan cdr) {
  if (type == ros2::CameraInfo::kType && !setup.camera) {
    const auto info = cdr::decode<ros2::CameraInfo>(cdr);
    if (!info) return tl::unexpected(info.error());
    Result<CameraModel> camera = ros2::from_ros(*info);
    if (!camera) return tl::unexpected(camera.error());
    setup.camera = std::move(*camera);
  }
  if (type == ros2::TFMessage::kType) {
    const auto transforms = cdr::decode<ros2::TFMessage>(cdr);
    if (!transforms) return tl::unexpected(transforms.error());
    for (const auto& transform : transforms->transforms) {
      if (transform.child_frame_id == ros2::kCameraFrame && ros2::sound(transform))
        setup.base_T_cam = ros2::from_ros(transform);
    }
  }
  return {};
}

Result<RecordingSetup> read_setup(const ByteSource& source) {
  const Result<mcap::Index> index = mcap::read_index(source);
  if (!index) return tl::unexpected(index.error());
  RecordingSetup setup{.problems = index->problems};
  for (const auto& entry : index->metadata) {
    const auto metadata = mcap::read_metadata(source, entry);
    if (!metadata) return tl::unexpected(metadata.error());
    setup.metadata[metadata->name] = metadata->metadata;
  }
  const mcap::Selection selection{.topics = {topics::kCameraInfo, topics::kTfStatic}};
  Status status = mcap::visit_messages(
      source, *index, selection, [&](const mcap::Channel& channel, const mcap::Message& message) {
        return add_to_setup(setup, type_of(*index, channel), message.data.bytes);
      });
  if (!status) return tl::unexpected(status.error());
  return setup;
}

Status visit_samples(const ByteSource& source, const std::function<Status(const Sample&)>& visit) {
  const Result<mcap::Index> index = mcap::read_index(source);
  if (!index) return tl::unexpected(index.error());
  SampleDecoder decoder(visit);
  Status status = mcap::visit_messages(
      source, *index, {}, [&](const mcap::Channel& channel, const mcap::Message& message) {
        return decoder.add(channel.topic, type_of(*index, channel), message.log_time, message.data.bytes);
      });
  return status ? decoder.finish() : status;
}

}  // namespace waymark
