#include "waymark/robots/ros2/log_publisher.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/offered_qos.hpp"
#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/ros2/other_publishers.hpp"
#include "waymark/robots/ros2/velocity_commands.hpp"

namespace waymark {
namespace {

constexpr const char* kStaticFrames = "/tf_static";

TopicQos qos_of(const LogChannel& channel) {
  const bool image = channel.type == ros2::Image::kType || channel.type == ros2::CompressedImage::kType;
  const bool kept = is_kept_for_late_joiners(channel);
  const bool few = image || (kept && channel.topic != kStaticFrames);
  return {.reliable = true, .transient_local = kept, .depth = few ? 5 : 100, .large = image};
}

bool is_command(const std::string& type) {
  return type == ros2::Twist::kType || type == ros2::TwistStamped::kType || type == "geometry_msgs/Twist" ||
         type == "geometry_msgs/TwistStamped";
}

bool many_publish(const std::string& topic) {
  return topic == "/tf" || topic == kStaticFrames || topic == "/diagnostics" || topic == "/rosout" ||
         topic == "/parameter_events";
}

/// Converts a recorded velocity command to `type` if necessary.
Result<Bytes> command_as(const std::string& type, const std::string& recorded, ByteSpan data,
                         const LogMessage& message) {
  if (type == recorded) return Bytes(data.begin(), data.end());
  if (type == ros2::Twist::kType) {
    const auto stamped = cdr::decode<ros2::TwistStamped>(data);
    return stamped ? Result<Bytes>(cdr::encode(stamped->twist)) : tl::unexpected(stamped.error());
  }
  const auto twist = cdr::decode<ros2::Twist>(data);
  if (!twist) return tl::unexpected(twist.error());
  const SensorTime logged(Duration(static_cast<std::int64_t>(message.log_time)));
  return cdr::encode(ros2::TwistStamped{{ros2::to_ros(logged), std::string(ros2::kBaseFrame)}, *twist});
}

}  // namespace

bool is_kept_for_late_joiners(const LogChannel& channel) {
  constexpr int kTransientLocal = 1;
  if (channel.topic == kStaticFrames || channel.type == ros2::CameraInfo::kType) return true;
  const auto offered = channel.metadata.find("offered_qos_profiles");
  return offered != channel.metadata.end() &&
         std::ranges::any_of(parse_offered_qos(offered->second),
                             [](const OfferedQos& qos) { return qos.durability == kTransientLocal; });
}

Status check_no_other_publisher(const std::vector<LogChannel>& channels, bool commands, const Bus& bus) {
  std::set<std::string> topics;
  std::set<std::string> programs;
  for (const LogChannel& channel : channels) {
    if (many_publish(channel.topic) || (is_command(channel.type) && !commands)) continue;
    const std::set<Guid> others = publishers_of(dds_topic(channel.topic, ""), bus);
    if (!others.empty()) topics.insert(channel.topic);
    for (const Guid& other : others) programs.insert(bus.participant_of(other));
  }
  if (topics.empty()) return {};
  return fail(
      ErrorCode::InvalidArgument,
      fmt::format("another program publishes {}; nodes: {}", fmt::join(topics, ", "),
                  fmt::join(programs, ", ")),
      {.source = "ROS 2"},
      "Recorded and live messages would be mixed. Stop that program, select other topics with `topics`, or "
      "set another ROS_DOMAIN_ID.");
}

/// The type used by the topic's subscriptions. It is the recorded type if a subscription has it, or if none
/// has a command type.
std::string LogPublisher::subscribed_command(const LogChannel& recorded) const {
  std::string other = recorded.type;
  for (const BusEndpoint& endpoint : bus_.endpoints()) {
    const auto name = ros_topic(endpoint.name);
    if (endpoint.publishes || !name || name->topic != recorded.topic) continue;
    if (name->type == recorded.type) return recorded.type;
    if (is_command(name->type)) other = name->type;
  }
  return other;
}

Result<LogPublisher::Publisher> LogPublisher::advertise(const LogChannel& recorded, bool moves) {
  const std::string type = moves ? subscribed_command(recorded) : recorded.type;
  if (type != recorded.type)
    pending_.push_back(
        fmt::format("{} has subscriptions of type {}: recorded messages of type {} are converted",
                    recorded.topic, type, recorded.type));
  const TopicUse use{true, dds_topic(recorded.topic, type), qos_of(recorded)};
  const auto made = bus_.advertise(use.name, use.qos);
  if (!made) return tl::unexpected(made.error());
  uses_.push_back(use);
  if (moves) {
    moving_[*made] = type == ros2::TwistStamped::kType;
    moves_(use.name);
  }
  return Publisher{*made, type};
}

Status LogPublisher::publish(const LogChannel& channel, const LogMessage& message) {
  const auto converted = channels_.convert(channel, message);
  if (!converted) {
    skipped_.insert(channel.topic);
    return {};
  }
  const LogChannel& as_ros2 = converted->channel->channel;
  const bool moves = is_command(as_ros2.type);
  if (moves && !commands_) {
    omitted_.insert(channel.topic);
    return {};
  }
  auto found = publishers_.find(channel.topic);
  if (found == publishers_.end()) {
    auto made = advertise(as_ros2, moves);
    if (!made) return tl::unexpected(made.error());
    found = publishers_.emplace(channel.topic, std::move(*made)).first;
  }
  const Publisher& to = found->second;
  if (!moves) {
    ++published_;
    return bus_.publish(to.number, converted->data);
  }
  const auto command = command_as(to.type, as_ros2.type, converted->data, message);
  if (!command) {
    skipped_.insert(channel.topic);
    return {};
  }
  ++published_;
  return bus_.publish(to.number, *command);
}

Status LogPublisher::publish_kept(MessageLog& log, const LogSelection& selection) {
  LogSelection before{.to = selection.from};
  for (const LogChannel& channel : log.channels())
    if (selection.takes(channel.topic) && is_kept_for_late_joiners(channel) && !is_command(channel.type))
      before.topics.insert(channel.topic);
  if (before.topics.empty() || selection.from == 0) return {};
  struct Newest {
    LogChannel channel{};
    std::uint64_t log_time = 0;
    Bytes data{};
  };
  std::map<std::string, Newest> newest;
  const Status read = log.visit(before, [&](const LogChannel& channel, const LogMessage& message) -> Status {
    if (channel.topic == kStaticFrames)
      return publish(channel, message);  // each message may contain different frames
    newest[channel.topic] = {channel, message.log_time, Bytes(message.data.begin(), message.data.end())};
    return {};
  });
  if (!read) return read;
  for (const auto& [topic, kept] : newest)
    if (Status sent = publish(kept.channel, {kept.log_time, kept.log_time, kept.data}); !sent) return sent;
  return {};
}

std::vector<std::string> LogPublisher::take_reports() {
  for (const std::string& reason : mismatches(uses_, bus_.endpoints()))
    if (reported_.insert(reason).second) pending_.push_back(reason);
  return std::exchange(pending_, {});
}

Status LogPublisher::stop() {
  for (const auto& [publisher, stamped] : moving_)
    if (Status status = publish_zero(bus_, publisher, stamped); !status) return status;
  return {};
}

}  // namespace waymark
