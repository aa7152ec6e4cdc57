#include "waymark/recording/sample_recorder.hpp"

#include <algorithm>
#include <utility>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/recording/ros2/cdr.hpp"

namespace waymark {
namespace {

// The offered QoS, with which `ros2 bag play` publishes a topic as a robot would.
constexpr OfferedQos kReliable{};
constexpr OfferedQos kLatched{.depth = 1, .durability = 1};

std::uint64_t nanoseconds(SensorTime stamp) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, stamp.time_since_epoch().count()));
}

}  // namespace

std::string topic_of_camera(const std::string& camera, const char* topic) {
  return camera == "cam" ? topic : "/" + camera + topic;
}

Result<SampleRecorder> SampleRecorder::open(std::unique_ptr<ByteSink> sink,
                                            const mcap::WriterOptions& options) {
  Result<mcap::Writer> writer = mcap::Writer::open(std::move(sink), options);
  if (!writer) return tl::unexpected(writer.error());
  return SampleRecorder(std::move(*writer));
}

Status SampleRecorder::write(const std::string& topic, std::string_view type, SensorTime stamp,
                             const Bytes& data) {
  if (!channels_.contains(topic)) {
    const auto schema = writer_.add_schema(std::string(type), "ros2msg", as_bytes(ros2::schema_text(type)));
    if (!schema) return tl::unexpected(schema.error());
    const OfferedQos& offered = topic == topics::kTfStatic ? kLatched : kReliable;
    const std::string qos = to_yaml({offered}, qos_notation_);
    const auto channel = writer_.add_channel(topic, *schema, "cdr", {{"offered_qos_profiles", qos}});
    if (!channel) return tl::unexpected(channel.error());
    channels_[topic] = *channel;
  }
  return writer_.write(channels_.at(topic), nanoseconds(stamp + arrival_delay_), nanoseconds(stamp), data);
}

template <class Message>
Status SampleRecorder::add_message(const std::string& topic, SensorTime stamp, const Message& message) {
  return write(topic, Message::kType, stamp, cdr::encode(message));
}
template Status SampleRecorder::add_message(const std::string&, SensorTime, const ros2::Odometry&);
template Status SampleRecorder::add_message(const std::string&, SensorTime, const ros2::TFMessage&);
template Status SampleRecorder::add_message(const std::string&, SensorTime, const ros2::PoseStamped&);
template Status SampleRecorder::add_message(const std::string&, SensorTime,
                                            const ros2::PoseWithCovarianceStamped&);
template Status SampleRecorder::add_message(const std::string&, SensorTime, const ros2::DiagnosticArray&);
template Status SampleRecorder::add_message(const std::string&, SensorTime, const ros2::Path&);
template Status SampleRecorder::add_message(const std::string&, SensorTime, const ros2::Twist&);
template Status SampleRecorder::add_message(const std::string&, SensorTime, const ros2::MarkerArray&);
template Status SampleRecorder::add_message(const std::string&, SensorTime, const ros2::CompressedImage&);
template Status SampleRecorder::add_message(const std::string&, SensorTime,
                                            const ros2::AprilTagDetectionArray&);

Status SampleRecorder::add_tags(const TagFrame& frame) {
  if (Status status =
          add_message(topic_of_camera(frame.camera, topics::kTags), frame.stamp, ros2::to_ros(frame));
      !status)
    return status;
  const bool known = std::ranges::any_of(frame.detections, [](const TagDetection& tag) {
    return usable_corners(tag) && tag.corner_covariance_px2.has_value();
  });
  if (known) {
    if (Status status = add_message(topic_of_camera(frame.camera, topics::kTagCovariances), frame.stamp,
                                    ros2::covariances_to_ros(frame));
        !status)
      return status;
  }
  return add_unreliable_tags(frame);
}

Status SampleRecorder::add_unreliable_tags(const TagFrame& frame) {
  if (count_unreliable(frame.detections) == 0) return {};
  return add_message(topic_of_camera(frame.camera, topics::kUnreliableTags), frame.stamp,
                     ros2::unreliable_to_ros(frame));
}

Status SampleRecorder::add_waiting_cameras(SensorTime stamp) {
  for (const MountedCamera& camera : std::exchange(cameras_, {})) {
    if (Status status = add_camera(stamp, camera.camera, camera.base_T_cam, camera.name); !status)
      return status;
  }
  return {};
}

Status SampleRecorder::close() {
  if (Status status = add_waiting_cameras({}); !status) return status;
  return writer_.close();
}

/// Data added before the image also arrived before it. Stamps from another clock, as after a clock jump, give
/// no such bound.
Duration SampleRecorder::arrival_delay_of_image(SensorTime stamp) const {
  constexpr Duration kMaxArrivalDelay = std::chrono::seconds(2);
  const Duration behind = newest_ ? *newest_ - stamp : Duration{};
  return behind <= kMaxArrivalDelay ? std::max(image_arrival_delay_, behind) : image_arrival_delay_;
}

Status SampleRecorder::add(const Sample& sample) {
  if (Status status = add_waiting_cameras(stamp_of(sample)); !status) return status;
  const bool seen = std::holds_alternative<TagFrame>(sample) || std::holds_alternative<CameraFrame>(sample) ||
                    std::holds_alternative<TagPoseFrame>(sample);
  arrival_delay_ = seen ? arrival_delay_of_image(stamp_of(sample)) : Duration{};
  if (!seen) newest_ = stamp_of(sample);
  const Status status = std::visit(
      [this](const auto& value) -> Status {
        using Kind = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_same_v<Kind, TagFrame>) {
          return add_tags(value);
        } else if constexpr (requires { value.camera; }) {
          return add_message(topic_of_camera(value.camera, topics::of(value)), value.stamp,
                             ros2::to_ros(value));
        } else {
          return add_message(topics::of(value), value.stamp, ros2::to_ros(value));
        }
      },
      sample);
  arrival_delay_ = {};
  return status;
}

Status SampleRecorder::add_camera(SensorTime stamp, const CameraModel& camera, const SE3& base_T_cam,
                                  const std::string& name) {
  if (Status status =
          add_message(topic_of_camera(name, topics::kCameraInfo), stamp, ros2::to_ros(camera, stamp, name));
      !status)
    return status;
  ros2::TFMessage message;
  message.transforms.push_back(
      ros2::to_ros_transform(stamp, ros2::kBaseFrame, ros2::camera_frame(name), base_T_cam));
  return add_message(topics::kTfStatic, stamp, message);
}

Status SampleRecorder::add_metadata(const std::string& name,
                                    const std::map<std::string, std::string>& values) {
  return writer_.write_metadata({.name = name, .metadata = values});
}

Status SampleRecorder::add_attachment(const std::string& name, const std::string& media_type,
                                      SensorTime stamp, std::string_view text) {
  return writer_.write_attachment({.log_time = nanoseconds(stamp),
                                   .create_time = nanoseconds(stamp),
                                   .name = name,
                                   .media_type = media_type,
                                   .data = {as_bytes(text)}});
}

namespace {

constexpr const char* kCompressed = "/image_raw/compressed";
constexpr int kJpegQuality = 92;

}  // namespace

Status record_image(const CameraFrame& frame, const std::string& how, SampleRecorder& recorder) {
  if (how.empty()) return {};
  if (how == "raw") return recorder.add(frame);
  auto bytes = encode_jpeg(frame.image, kJpegQuality);
  if (!bytes) return tl::unexpected(bytes.error());
  ros2::CompressedImage message;
  message.header = ros2::to_ros(CameraFrame{.stamp = frame.stamp, .camera = frame.camera}).header;
  message.format = "jpeg";
  message.data = std::move(*bytes);
  return recorder.add_message(topic_of_camera(frame.camera, kCompressed), frame.stamp, message);
}

}  // namespace waymark
