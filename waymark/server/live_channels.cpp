#include "waymark/server/live_channels.hpp"

#include <type_traits>
#include <utility>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

constexpr int kImageQuality = 80;
constexpr const char* kCompressed = "/image_raw/compressed";
constexpr const char* kNis = "/waymark/nis";
constexpr const char* kMap = "/waymark/map";

}  // namespace

LiveChannels::Target LiveChannels::target(const std::string& topic, std::string_view type,
                                          const std::set<std::uint32_t>& wanted) {
  const auto found = by_topic_.find(topic);
  if (found != by_topic_.end())
    return {found->second, known_[found->second].latched || wanted.contains(found->second)};
  const auto id = static_cast<std::uint32_t>(known_.size());
  by_topic_[topic] = id;
  known_.push_back({.id = id,
                    .topic = topic,
                    .type = std::string(type),
                    .newest = type == ros2::CompressedImage::kType,
                    .latched = topic == topics::kTfStatic || type == ros2::CameraInfo::kType ||
                               type == ros2::MarkerArray::kType});
  return {id, known_.back().latched};
}

template <class Message>
void LiveChannels::put(const std::string& topic, const Message& message, std::int64_t host_ns,
                       const std::set<std::uint32_t>& wanted, std::vector<LiveMessage>& out) {
  const auto [id, is_wanted] = target(topic, Message::kType, wanted);
  if (!is_wanted) return;
  out.push_back({id, host_ns, std::make_shared<const Bytes>(cdr::encode(message))});
  if (known_[id].latched) latched_[id] = out.back();
}

void LiveChannels::put_image(const CameraFrame& frame, std::int64_t host_ns,
                             const std::set<std::uint32_t>& wanted, std::vector<LiveMessage>& out) {
  const std::string topic = topic_of_camera(frame.camera, kCompressed);
  if (!target(topic, ros2::CompressedImage::kType, wanted).wanted) return;
  auto jpeg = encode_jpeg(frame.image, kImageQuality);
  if (!jpeg) return;  // images may have no pixels
  const CameraFrame head{.stamp = frame.stamp, .camera = frame.camera};
  put(topic,
      ros2::CompressedImage{.header = ros2::to_ros(head).header, .format = "jpeg", .data = std::move(*jpeg)},
      host_ns, wanted, out);
}

/// Unreliable tags precede the others of their image, so that a page that shows an image once its tags have
/// arrived has both.
void LiveChannels::put_tags(const TagFrame& frame, std::int64_t host_ns,
                            const std::set<std::uint32_t>& wanted, std::vector<LiveMessage>& out) {
  const std::string unreliable = topic_of_camera(frame.camera, topics::kUnreliableTags);
  // Adds the channel before its first message, which viewers would otherwise miss.
  static_cast<void>(target(unreliable, ros2::UnreliableTags::kType, wanted));
  if (count_unreliable(frame.detections) > 0)
    put(unreliable, ros2::unreliable_to_ros(frame), host_ns, wanted, out);
  put(topic_of_camera(frame.camera, topics::of(frame)), ros2::to_ros(frame), host_ns, wanted, out);
}

/// The transform from odom to base_link is the odometry. The transform from map to odom is such that
/// base_link is at the estimate.
void LiveChannels::put_frames(const LiveSample& sample, const std::set<std::uint32_t>& wanted,
                              std::vector<LiveMessage>& out) {
  ros2::TFMessage frames;
  if (const auto* estimate = std::get_if<ros2::PoseWithCovarianceStamped>(&sample.value)) {
    if (!odometry_) return;
    const SE3 map_T_base = ros2::from_ros(estimate->pose.pose);
    frames.transforms.push_back(ros2::to_ros_transform(ros2::from_ros(estimate->header.stamp),
                                                       ros2::kMapFrame, ros2::kOdomFrame,
                                                       map_T_base * lift(odometry_->odom_T_base).inverse()));
    return put(topics::kTf, frames, sample.host_ns, wanted, out);
  }
  const auto* received = std::get_if<Sample>(&sample.value);
  if (const auto* odometry = received != nullptr ? std::get_if<Odometry>(received) : nullptr) {
    odometry_ = *odometry;
    frames.transforms.push_back(ros2::to_ros_transform(odometry->stamp, ros2::kOdomFrame, ros2::kBaseFrame,
                                                       lift(odometry->odom_T_base)));
    put(topics::kTf, frames, sample.host_ns, wanted, out);
  }
}

std::vector<LiveMessage> LiveChannels::encode(const LiveSample& sample,
                                              const std::set<std::uint32_t>& wanted) {
  std::vector<LiveMessage> out;
  if (const auto* estimate = std::get_if<ros2::PoseWithCovarianceStamped>(&sample.value)) {
    put(topics::kEstimate, *estimate, sample.host_ns, wanted, out);
  } else if (const auto* compared = std::get_if<ros2::DiagnosticArray>(&sample.value)) {
    put(kNis, *compared, sample.host_ns, wanted, out);
  } else {
    std::visit(
        [&](const auto& value) {
          using Kind = std::remove_cvref_t<decltype(value)>;
          if constexpr (std::is_same_v<Kind, CameraFrame>)
            put_image(value, sample.host_ns, wanted, out);
          else if constexpr (std::is_same_v<Kind, TagFrame>)
            put_tags(value, sample.host_ns, wanted, out);
          else if constexpr (requires { value.camera; })
            put(topic_of_camera(value.camera, topics::of(value)), ros2::to_ros(value), sample.host_ns, wanted,
                out);
          else
            put(topics::of(value), ros2::to_ros(value), sample.host_ns, wanted, out);
        },
        std::get<Sample>(sample.value));
  }
  put_frames(sample, wanted, out);
  return out;
}

std::vector<LiveMessage> LiveChannels::encode(const LiveFeed::Mounted& camera, std::int64_t host_ns) {
  std::vector<LiveMessage> out;
  put(topics::kCameraInfo, ros2::to_ros(camera.camera, SensorTime{}), host_ns, {}, out);
  ros2::TFMessage frames;
  frames.transforms.push_back(
      ros2::to_ros_transform({}, ros2::kBaseFrame, ros2::kCameraFrame, camera.base_T_cam));
  put(topics::kTfStatic, frames, host_ns, {}, out);
  return out;
}

std::vector<LiveMessage> LiveChannels::encode(const ros2::MarkerArray& shapes, std::int64_t host_ns) {
  std::vector<LiveMessage> out;
  put(kMap, shapes, host_ns, {}, out);
  return out;
}

LiveMessage LiveChannels::encode_json(const std::string& topic, std::string_view object,
                                      std::int64_t host_ns) {
  const std::uint32_t id = target(topic, "waymark.State", {}).id;
  known_[id].json = known_[id].latched = known_[id].newest = true;
  LiveMessage message{id, host_ns, std::make_shared<const Bytes>(object.begin(), object.end())};
  latched_[id] = message;
  return message;
}

const LiveMessage* LiveChannels::latched(std::uint32_t channel) const {
  const auto found = latched_.find(channel);
  return found == latched_.end() ? nullptr : &found->second;
}

}  // namespace waymark
