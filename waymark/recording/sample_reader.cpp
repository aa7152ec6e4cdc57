#include "waymark/recording/sample_reader.hpp"

#include "waymark/recording/cdr.hpp"
#include "waymark/recording/ros2_convert.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

std::string type_of(const mcap::Index& index, const mcap::Channel& channel) {
  const auto schema = index.schemas.find(channel.schema_id);
  return schema == index.schemas.end() ? "" : schema->second.name;
}

}  // namespace

class SampleDecoder::Impl {
 public:
  explicit Impl(Visitor visit) : visit_(std::move(visit)) {}

  Status add(std::string_view topic, std::string_view type, std::uint64_t /*log_time*/, ByteSpan message) {
    if (type == ros2::AprilTagDetectionArray::kType) return on_tags(message);
    if (type == ros2::TagCornerCovariances::kType) return on_covariances(message);
    if (Status status = send_frame(); !status) return status;
    if (type == ros2::Odometry::kType) return give<ros2::Odometry>(message);
    if (type == ros2::JointState::kType) return give<ros2::JointState>(message);
    if (type == ros2::Imu::kType) return give<ros2::Imu>(message);
    if (type == ros2::TwistStamped::kType) return give<ros2::TwistStamped>(message);
    if (type == ros2::PoseStamped::kType && topic == topics::kTruth) return on_truth(message);
    return {};
  }

  /// A frame waits for the covariances that follow it.
  Status send_frame() {
    if (!frame_) return {};
    const Sample sample = *std::move(frame_);
    frame_.reset();
    return visit_(sample);
  }

 private:
  template <class Message>
  Status give(ByteSpan raw) {
    const Result<Message> message = cdr::decode<Message>(raw);
    if (!message) return tl::unexpected(message.error());
    auto sample = ros2::from_ros(*message);
    if constexpr (requires { sample.error(); }) {
      if (!sample) return tl::unexpected(sample.error());
      return visit_(*sample);
    } else {
      return visit_(sample);
    }
  }

  Status on_tags(ByteSpan raw) {
    if (Status status = send_frame(); !status) return status;
    const auto message = cdr::decode<ros2::AprilTagDetectionArray>(raw);
    if (!message) return tl::unexpected(message.error());
    Result<TagFrame> frame = ros2::from_ros(*message);
    if (!frame) return tl::unexpected(frame.error());
    frame_ = std::move(*frame);
    return {};
  }

  Status on_covariances(ByteSpan raw) {
    const auto message = cdr::decode<ros2::TagCornerCovariances>(raw);
    if (!message) return tl::unexpected(message.error());
    const bool same_frame = frame_ && frame_->stamp == ros2::from_ros(message->header.stamp);
    return same_frame ? ros2::add_covariances(*frame_, *message) : Status{};
  }

  Status on_truth(ByteSpan raw) {
    const auto message = cdr::decode<ros2::PoseStamped>(raw);
    if (!message) return tl::unexpected(message.error());
    return visit_(TruthPose{ros2::from_ros(message->header.stamp), ros2::from_ros(message->pose)});
  }

  Visitor visit_;
  std::optional<TagFrame> frame_;
};

SampleDecoder::SampleDecoder(Visitor visit) : impl_(std::make_unique<Impl>(std::move(visit))) {}
SampleDecoder::~SampleDecoder() = default;
Status SampleDecoder::add(std::string_view topic, std::string_view type, std::uint64_t log_time,
                          ByteSpan cdr) {
  return impl_->add(topic, type, log_time, cdr);
}
Status SampleDecoder::finish() { return impl_->send_frame(); }

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
      if (transform.child_frame_id == ros2::kCameraFrame) setup.base_T_cam = ros2::from_ros(transform);
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
