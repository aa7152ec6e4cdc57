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

/// A stream of messages of one type, as in a recording.
struct LiveChannel {
  std::uint32_t id = 0;
  std::string topic;     ///< "/odom"
  std::string type;      ///< "nav_msgs/msg/Odometry"
  bool json = false;     ///< JSON objects instead of ROS messages
  bool newest = false;   ///< an unsent message (image) is replaced by a newer one
  bool latched = false;  ///< new viewers receive the last message
};

/// One message for viewers; they share its bytes.
struct LiveMessage {
  std::uint32_t channel = 0;
  std::int64_t host_ns = 0;
  std::shared_ptr<const Bytes> cdr;
};

/// Converts samples of a robot to ROS 2 messages on the topics of docs/formats/recording.md. Images become
/// JPEG. Also publishes the transforms of map, odom, base_link and the camera.
class LiveChannels {
 public:
  /// Messages of a sample. Messages of channels not in `wanted` are not encoded, but the channels are
  /// registered.
  [[nodiscard]] std::vector<LiveMessage> encode(const LiveSample& sample,
                                                const std::set<std::uint32_t>& wanted);
  [[nodiscard]] std::vector<LiveMessage> encode(const LiveFeed::Mounted& camera, std::int64_t host_ns);
  [[nodiscard]] std::vector<LiveMessage> encode(const ros2::MarkerArray& shapes, std::int64_t host_ns);
  /// An object that is already JSON text, on a latched JSON channel.
  [[nodiscard]] LiveMessage encode_json(const std::string& topic, std::string_view object,
                                        std::int64_t host_ns);

  /// All channels so far; an id is an index into it.
  [[nodiscard]] const std::vector<LiveChannel>& known() const { return known_; }
  /// The last message of a latched channel; nullptr if there is none.
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
  void put_picture(const CameraFrame& frame, std::int64_t host_ns, const std::set<std::uint32_t>& wanted,
                   std::vector<LiveMessage>& out);

  std::vector<LiveChannel> known_;
  std::map<std::string, std::uint32_t, std::less<>> by_topic_;
  std::map<std::uint32_t, LiveMessage> latched_;
  std::optional<Odometry> odometry_{};
};

}  // namespace waymark
