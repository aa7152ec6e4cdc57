#include "waymark/recording/ros2/sample_decoder.hpp"

#include <algorithm>
#include <utility>

#include "waymark/recording/mcap/reader.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/transform_odometry.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

constexpr std::string_view kTruthPrefix = "/truth/";
constexpr std::string_view kFixedTransforms = "tf_static";

struct Ros2Message {
  std::string_view topic{};
  std::string_view type{};
  std::uint64_t log_time = 0;
  ByteSpan cdr{};
};

Error named(Error error, const Ros2Message& raw) {
  if (error.place.key.empty()) error.place.key = std::string(raw.topic);
  return error;
}

/// Decodes a message; non-finite numbers and invalid rotations are errors.
template <class Message>
Result<Message> read(const Ros2Message& raw) {
  Result<Message> message = cdr::decode<Message>(raw.cdr);
  if (!message) return tl::unexpected(named(message.error(), raw));
  if constexpr (requires { ros2::sound(*message); }) {
    if (!ros2::sound(*message))
      return tl::unexpected(
          named({ErrorCode::Unreadable, "non-finite numbers or a zero quaternion in the message"}, raw));
  }
  return message;
}

std::string_view type_of(const mcap::Index& index, const mcap::Channel& channel) {
  const auto schema = index.schemas.find(channel.schema_id);
  return schema == index.schemas.end() ? std::string_view() : schema->second.name;
}

}  // namespace

class SampleDecoder::Impl {
 public:
  explicit Impl(Visitor visit) : visit_(std::move(visit)) {}
  void use_transforms(std::optional<OdometryFrames> link) { transforms_.emplace(std::move(link)); }
  Status add(const Ros2Message& raw);
  Status finish();

 private:
  template <class Message>
  Status give(const Ros2Message& raw);
  Status on_tags(const Ros2Message& raw);
  Status on_covariances(const Ros2Message& raw);
  Status on_unreliable(const Ros2Message& raw);
  template <class Message>
  [[nodiscard]] bool belongs_to_frame(const Message& message) const;
  Status on_truth(const Ros2Message& raw);
  Status on_twist(const Ros2Message& raw);
  Status on_joints(const Ros2Message& raw);
  Status on_transforms(const Ros2Message& raw);

  Visitor visit_;
  std::optional<ros2::TransformOdometry> transforms_{};
  /// Waits for the covariances and unreliable tags that may follow it.
  std::optional<TagFrame> frame_{};
};

template <class Message>
Status SampleDecoder::Impl::give(const Ros2Message& raw) {
  const Result<Message> message = read<Message>(raw);
  if (!message) return tl::unexpected(message.error());
  auto sample = ros2::from_ros(*message);
  if constexpr (requires { sample.error(); }) {
    if (!sample) return tl::unexpected(named(sample.error(), raw));
    return visit_(*std::move(sample));
  } else {
    return visit_(std::move(sample));
  }
}

Status SampleDecoder::Impl::add(const Ros2Message& raw) {
  if (raw.type == ros2::TagCornerCovariances::kType) return on_covariances(raw);
  if (raw.type == ros2::UnreliableTags::kType) return on_unreliable(raw);
  if (Status status = finish(); !status) return status;
  if (raw.topic.starts_with(kTruthPrefix)) return on_truth(raw);
  if (raw.type == ros2::AprilTagDetectionArray::kType) return on_tags(raw);
  if (raw.type == ros2::Odometry::kType) return give<ros2::Odometry>(raw);
  if (raw.type == ros2::TFMessage::kType) return on_transforms(raw);
  if (raw.type == ros2::JointState::kType) return on_joints(raw);
  if (raw.type == ros2::Imu::kType) return give<ros2::Imu>(raw);
  if (raw.type == ros2::TwistStamped::kType) return give<ros2::TwistStamped>(raw);
  if (raw.type == ros2::Twist::kType) return on_twist(raw);
  if (raw.type == ros2::Image::kType) return give<ros2::Image>(raw);
  if (raw.type == ros2::CompressedImage::kType) return give<ros2::CompressedImage>(raw);
  if (raw.type == ros2::LaserScan::kType) return give<ros2::LaserScan>(raw);
  if (raw.type == ros2::Joy::kType) return give<ros2::Joy>(raw);
  if (raw.type == ros2::RangeBearing::kType) return give<ros2::RangeBearing>(raw);
  if (raw.type == ros2::ApriltagArrayStamped::kType) return give<ros2::ApriltagArrayStamped>(raw);
  if (raw.type == ros2::TagPoseArray::kType) return give<ros2::TagPoseArray>(raw);
  return {};
}

Status SampleDecoder::Impl::finish() {
  if (!frame_) return {};
  const Sample sample = *std::move(frame_);
  frame_.reset();
  return visit_(sample);
}

Status SampleDecoder::Impl::on_tags(const Ros2Message& raw) {
  const auto message = read<ros2::AprilTagDetectionArray>(raw);
  if (!message) return tl::unexpected(message.error());
  Result<TagFrame> frame = ros2::from_ros(*message);
  if (!frame) return tl::unexpected(named(frame.error(), raw));
  frame_ = std::move(*frame);
  return {};
}

template <class Message>
bool SampleDecoder::Impl::belongs_to_frame(const Message& message) const {
  return frame_ && frame_->stamp == ros2::from_ros(message.header.stamp) &&
         frame_->camera == ros2::camera_of_frame(message.header.frame_id);
}

Status SampleDecoder::Impl::on_covariances(const Ros2Message& raw) {
  const auto message = cdr::decode<ros2::TagCornerCovariances>(raw.cdr);
  if (!message) return tl::unexpected(named(message.error(), raw));
  return belongs_to_frame(*message) ? ros2::add_covariances(*frame_, *message) : Status{};
}

Status SampleDecoder::Impl::on_unreliable(const Ros2Message& raw) {
  const auto message = read<ros2::UnreliableTags>(raw);
  if (!message) return tl::unexpected(message.error());
  if (!belongs_to_frame(*message)) return {};
  const Status status = ros2::add_unreliable(*frame_, *message);
  return status ? status : tl::unexpected(named(status.error(), raw));
}

Status SampleDecoder::Impl::on_truth(const Ros2Message& raw) {
  if (raw.type != ros2::PoseStamped::kType) return {};
  const auto message = read<ros2::PoseStamped>(raw);
  if (!message) return tl::unexpected(message.error());
  return visit_(TruthPose{ros2::from_ros(message->header.stamp), ros2::from_ros(message->pose)});
}

Status SampleDecoder::Impl::on_twist(const Ros2Message& raw) {
  const auto message = read<ros2::Twist>(raw);
  if (!message) return tl::unexpected(message.error());
  return visit_(StampedCommand{SensorTime(Duration(static_cast<std::int64_t>(raw.log_time))),
                               {message->linear.x, message->angular.z}});
}

/// Joints of arms and pan heads are skipped; only messages with wheels are samples.
Status SampleDecoder::Impl::on_joints(const Ros2Message& raw) {
  const auto message = read<ros2::JointState>(raw);
  if (!message) return tl::unexpected(message.error());
  const bool wheels = std::ranges::any_of(
      message->name, [](const std::string& name) { return name.find("wheel") != std::string::npos; });
  return wheels ? give<ros2::JointState>(raw) : Status{};
}

/// Only moving transforms are odometry.
Status SampleDecoder::Impl::on_transforms(const Ros2Message& raw) {
  if (!transforms_ || raw.topic.ends_with(kFixedTransforms)) return {};
  const auto message = cdr::decode<ros2::TFMessage>(raw.cdr);
  if (!message) return tl::unexpected(named(message.error(), raw));
  for (const ros2::TransformStamped& transform : message->transforms) {
    const auto odometry = transforms_->add(raw.topic, transform);
    if (!odometry) return tl::unexpected(named(odometry.error(), raw));
    if (!*odometry) continue;
    if (Status status = visit_(**odometry); !status) return status;
  }
  return {};
}

SampleDecoder::SampleDecoder(Visitor visit) : impl_(std::make_unique<Impl>(std::move(visit))) {}
SampleDecoder::~SampleDecoder() = default;
void SampleDecoder::use_transforms(std::optional<OdometryFrames> link) {
  impl_->use_transforms(std::move(link));
}
Status SampleDecoder::add(std::string_view topic, std::string_view type, std::uint64_t log_time,
                          ByteSpan cdr) {
  return impl_->add({topic, type, log_time, cdr});
}
Status SampleDecoder::finish() { return impl_->finish(); }

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
        return add_fact(setup.facts, channel.topic, type_of(*index, channel), message.data.bytes);
      });
  if (!status) return tl::unexpected(status.error());
  choose(setup);
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
