#include "waymark/drivers/ros2/log_publisher.hpp"

#include "waymark/drivers/dds/ros_names.hpp"
#include "waymark/drivers/ros2/velocity_message.hpp"
#include "waymark/recording/ros2_messages.hpp"

namespace waymark {
namespace {

TopicQos qos_of(const LogChannel& channel) {
  const bool kept = channel.topic == "/tf_static" || channel.type == ros2::CameraInfo::kType;
  const bool picture = channel.type == ros2::Image::kType || channel.type == ros2::CompressedImage::kType;
  return {.reliable = true, .transient_local = kept, .depth = kept || picture ? 5 : 100, .large = picture};
}

}  // namespace

Status LogPublisher::publish(const LogChannel& channel, const LogMessage& message) {
  const auto converted = channels_.convert(channel, message);
  if (!converted) {
    passed_over_.insert(channel.topic);
    return {};
  }
  const std::string& type = converted->channel->channel.type;
  const bool stamped = type == ros2::TwistStamped::kType;
  const bool moves = stamped || type == ros2::Twist::kType;
  if (moves && !commands_) {
    left_out_.insert(channel.topic);
    return {};
  }
  auto known = publishers_.find(channel.topic);
  if (known == publishers_.end()) {
    const LogChannel& as_ros2 = converted->channel->channel;
    const auto made = bus_.advertise(dds_topic(as_ros2.topic, as_ros2.type), qos_of(as_ros2));
    if (!made) return tl::unexpected(made.error());
    known = publishers_.emplace(channel.topic, *made).first;
    if (moves) moving_[known->second] = stamped;
  }
  ++published_;
  return bus_.publish(known->second, converted->data);
}

Status LogPublisher::stop() {
  for (const auto& [publisher, stamped] : moving_)
    if (Status status = publish_zero(bus_, publisher, stamped); !status) return status;
  return {};
}

}  // namespace waymark
