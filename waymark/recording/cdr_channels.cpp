#include "waymark/recording/cdr_channels.hpp"

#include <fmt/format.h>

#include "waymark/recording/ros2_messages.hpp"

namespace waymark {
namespace {

/// Where a channel's metadata keeps the ROS 1 spelling of the type; MCAP files have it as the schema's name.
std::string ros1_type(const LogChannel& channel) {
  const auto name = channel.metadata.find("ros1_type");
  return name == channel.metadata.end() ? ros::short_type(channel.type) : name->second;
}

/// Whether the definition a recording carries lays the bytes as ours of the same name does.
bool fits_ours(const LogChannel& channel) {
  const std::string ours = ros2::schema_text(channel.type);
  if (ours.empty() || channel.schema_encoding != "ros2msg" || channel.schema.empty()) return true;
  if (channel.schema == ours) return true;
  const auto a = ros::parse_definition(channel.type, ours);
  const auto b = ros::parse_definition(channel.type, channel.schema);
  // A definition that our parser does not know all of is no proof that the bytes differ.
  return !a || !b || ros::wire_layout(*a) == ros::wire_layout(*b);
}

}  // namespace

const CdrChannels::Channel* CdrChannels::channel(const LogChannel& channel) {
  const auto known = known_.find(&channel);
  if (known != known_.end()) return known->second.get();
  auto made = std::make_unique<Channel>(Channel{.channel = channel});
  if (channel.encoding == "ros1") {
    auto transcoder = ros::Ros1Transcoder::make(ros1_type(channel), channel.schema);
    if (transcoder) {
      made->channel.type = transcoder->type();
      made->channel.encoding = "cdr";
      made->channel.schema_encoding = "ros2msg";
      made->channel.schema = transcoder->schema();
      made->known_layout = transcoder->same_as_ros2();
      made->transcoder = std::move(*transcoder);
    } else {
      Error error = transcoder.error();
      error.place.key = channel.topic;
      note_(LogProblem::Kind::Damage, "ros1.definition:" + channel.topic, error);
      made.reset();
    }
  } else if (channel.encoding == "cdr") {
    made->known_layout = fits_ours(channel);
  } else {
    made.reset();
  }
  if (made && !made->known_layout) {
    note_(LogProblem::Kind::Trap, "ros.other_layout:" + channel.topic,
          Error{ErrorCode::Unsupported,
                fmt::format("its {} has other fields than that of ROS 2: passed on, but not read as samples",
                            made->channel.type),
                {.key = channel.topic},
                {}});
  }
  return known_.emplace(&channel, std::move(made)).first->second.get();
}

std::optional<CdrChannels::Message> CdrChannels::convert(const LogChannel& channel,
                                                         const LogMessage& message) {
  const Channel* rewritten = this->channel(channel);
  if (rewritten == nullptr) return std::nullopt;
  if (!rewritten->transcoder) return Message{rewritten, message.data};
  cdr_.clear();
  if (Status status = rewritten->transcoder->transcode(message.data, cdr_); !status) {
    Error error = status.error();
    error.place.key = channel.topic;
    note_(LogProblem::Kind::Damage, "ros1.message:" + channel.topic, error);
    return std::nullopt;
  }
  return Message{rewritten, cdr_};
}

}  // namespace waymark
