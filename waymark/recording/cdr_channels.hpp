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

/// Rewrites messages of one ROS 1 type as ROS 2 writes them (plain little-endian CDR), by the definition that
/// the recording carries, so that types nobody here has heard of pass as well. Header.seq is dropped: ROS 2
/// has none.
class Ros1Transcoder {
 public:
  /// `type` as ROS 1 writes it: "sensor_msgs/Image". Fails when the definition makes no sense.
  static Result<Ros1Transcoder> make(std::string_view type, std::string_view definition);

  /// "sensor_msgs/msg/Image". tf/tfMessage, which became tf2_msgs/TFMessage, has the new name.
  [[nodiscard]] const std::string& type() const { return type_; }
  /// ROS 2's own text where we have it and the bytes are in the same order (it names fields as ROS 2 does: k,
  /// not K); else the recording's definition in the words of ROS 2.
  [[nodiscard]] const std::string& schema() const { return schema_; }
  /// Whether the bytes lie as in ROS 2's type of that name (true for a name we have no text of).
  [[nodiscard]] bool same_as_ros2() const { return same_; }

  /// Whether a message loses its Header.seq.
  [[nodiscard]] bool drops_sequence_numbers() const;

  /// Appends the message to `out`. Fails when it does not end where its definition does. O(message).
  Status transcode(ByteSpan message, Bytes& out) const;

 private:
  Definition definition_;
  std::string type_;
  std::string schema_;
  bool same_ = true;
};

}  // namespace waymark::ros

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
