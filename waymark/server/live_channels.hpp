#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/recording/byte_io.hpp"
#include "waymark/server/live_feed.hpp"

namespace waymark {

/// A stream of messages of the same type, as in a recording.
struct LiveChannel {
  std::uint32_t id = 0;
  std::string topic;     ///< such as "/odom"
  std::string type;      ///< such as "nav_msgs/msg/Odometry"
  bool json = false;     ///< whether messages are JSON objects rather than ROS messages
  bool newest = false;   ///< whether a newer message replaces one that has not been sent yet (images)
  bool latched = false;  ///< whether new viewers receive the last message
};

/// A message for viewers, which share its bytes.
struct LiveMessage {
  std::uint32_t channel = 0;
  std::int64_t host_ns = 0;
  std::shared_ptr<const Bytes> cdr;
};

/// Converts samples from a robot to ROS 2 messages on the topics in docs/formats/recording.md. Images become
/// JPEG. Also publishes the transforms between map, odom, base_link and the camera.
class LiveChannels {
 public:
  /// Converts a sample to messages. Messages on channels that are not in `wanted` are not encoded, but their
  /// channels are registered.
  [[nodiscard]] std::vector<LiveMessage> encode(const LiveSample& sample,
                                                const std::set<std::uint32_t>& wanted);
  [[nodiscard]] std::vector<LiveMessage> encode(const LiveFeed::Mounted& camera, std::int64_t host_ns);
  [[nodiscard]] std::vector<LiveMessage> encode(const ros2::MarkerArray& shapes, std::int64_t host_ns);
  /// A message on a latched JSON channel, from an object that is already JSON text.
  [[nodiscard]] LiveMessage encode_json(const std::string& topic, std::string_view object,
                                        std::int64_t host_ns);

  /// All channels so far; an ID is an index into this list.
  [[nodiscard]] const std::vector<LiveChannel>& known() const { return known_; }
  /// The last message on a latched channel; nullptr if there is none.
  [[nodiscard]] const LiveMessage* latched(std::uint32_t channel) const;

 private:
  struct Target {
    std::uint32_t id;
    bool wanted;
  };
  Target target(const std::string& topic, std::string_view type, const std::set<std::uint32_t>& wanted);
  template <class Message>
  void put(const std::string& topic, const Message& message, std::int64_t host_ns,
           const std::set<std::uint32_t>& wanted, std::vector<LiveMessage>& out);
  void put_frames(const LiveSample& sample, const std::set<std::uint32_t>& wanted,
                  std::vector<LiveMessage>& out);
  void put_image(const CameraFrame& frame, std::int64_t host_ns, const std::set<std::uint32_t>& wanted,
                 std::vector<LiveMessage>& out);
  void put_tags(const TagFrame& frame, std::int64_t host_ns, const std::set<std::uint32_t>& wanted,
                std::vector<LiveMessage>& out);

  std::vector<LiveChannel> known_;
  std::map<std::string, std::uint32_t, std::less<>> by_topic_;
  std::map<std::uint32_t, LiveMessage> latched_;
  std::optional<Odometry> odometry_{};
};

}  // namespace waymark
