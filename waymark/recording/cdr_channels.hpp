#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros1_transcoder.hpp"

namespace waymark {

/// Messages of any ROS channel as ROS 2 writes them: what is CDR already passes, what ROS 1 wrote is
/// rewritten by the definition its channel carries.
class CdrChannels {
 public:
  struct Channel {
    LogChannel channel{};  ///< type, schema and encoding as ROS 2 has them
    /// Whether the definition it carries lays the bytes as ROS 2's type of that name; else our structs do not
    /// decode it.
    bool known_layout = true;
    std::optional<ros::Ros1Transcoder> transcoder{};
  };
  struct Message {
    const Channel* channel = nullptr;
    ByteSpan data{};  ///< gone with the next call
  };
  using Note = std::function<void(LogProblem::Kind, const std::string& key, const Error&)>;

  explicit CdrChannels(Note note) : note_(std::move(note)) {}

  /// The channel rewritten; nullptr for one whose definition makes no sense (noted) or of no ROS encoding.
  const Channel* channel(const LogChannel& channel);
  /// The message rewritten; nothing when it does not fit its definition (noted), or the channel does not.
  std::optional<Message> convert(const LogChannel& channel, const LogMessage& message);

 private:
  std::map<const LogChannel*, std::unique_ptr<Channel>> known_;
  Note note_;
  Bytes cdr_;
};

}  // namespace waymark
