#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros_definition.hpp"

namespace waymark::ros {

/// Converts messages of one ROS 1 type to the ROS 2 encoding (plain little-endian CDR). It uses the
/// definition in the recording, so unknown message types are converted too. Header.seq is dropped, because
/// ROS 2 has no such field.
class Ros1Transcoder {
 public:
  /// `type` is in ROS 1 spelling: "sensor_msgs/Image". Fails if the definition is invalid.
  static Result<Ros1Transcoder> make(std::string_view type, std::string_view definition);

  /// The type in ROS 2 spelling: "sensor_msgs/msg/Image". tf/tfMessage becomes tf2_msgs/msg/TFMessage.
  [[nodiscard]] const std::string& type() const { return type_; }
  /// The ROS 2 definition if one is built in and has the same byte layout (field names may differ, such as k
  /// and K). Otherwise, the recorded definition in ROS 2 syntax.
  [[nodiscard]] const std::string& schema() const { return schema_; }
  /// Whether the ROS 2 type of the same name has this byte layout (true for types without a built-in
  /// definition).
  [[nodiscard]] bool same_as_ros2() const { return same_; }

  /// Whether messages lose their Header.seq.
  [[nodiscard]] bool drops_sequence_numbers() const;

  /// Appends the converted message to `out`. Fails unless the message ends exactly where its definition does.
  /// O(message).
  Status transcode(ByteSpan message, Bytes& out) const;

 private:
  Definition definition_;
  std::string type_;
  std::string schema_;
  bool same_ = true;
};

}  // namespace waymark::ros

namespace waymark {

/// Converts messages of any ROS channel to CDR. CDR passes unchanged; ROS 1 messages are converted using the
/// definition of their channel.
class CdrChannels {
 public:
  struct Channel {
    LogChannel channel{};  ///< type, schema and encoding of ROS 2
    /// Whether the channel's definition has the byte layout of the ROS 2 type with that name. If not, the
    /// built-in structs cannot decode its messages.
    bool known_layout = true;
    std::optional<ros::Ros1Transcoder> transcoder{};
  };
  struct Message {
    const Channel* channel = nullptr;
    ByteSpan data{};  ///< valid until the next call
  };
  using Note = std::function<void(LogProblem::Kind, const std::string& key, const Error&)>;

  explicit CdrChannels(Note note) : note_(std::move(note)) {}

  /// The converted channel; nullptr if its definition is invalid (which is noted) or its encoding is not a
  /// ROS encoding.
  const Channel* channel(const LogChannel& channel);
  /// The converted message; empty if it does not match its definition (which is noted) or the channel cannot
  /// be converted.
  std::optional<Message> convert(const LogChannel& channel, const LogMessage& message);

 private:
  std::map<const LogChannel*, std::unique_ptr<Channel>> known_;
  Note note_;
  Bytes cdr_;
};

}  // namespace waymark
