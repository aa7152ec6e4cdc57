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

/// A stream of messages of one type, as it would stand in a recording.
struct LiveChannel {
  std::uint32_t id = 0;
  std::string topic;     ///< "/odom"
  std::string type;      ///< "nav_msgs/msg/Odometry"
  bool json = false;     ///< no ROS message, but an object in JSON
  bool newest = false;   ///< only the newest counts: a picture that was not sent yet is replaced
  bool latched = false;  ///< who comes later gets the last one
};

/// One message on its way to viewers; the bytes are shared among them.
struct LiveMessage {
  std::uint32_t channel = 0;
  std::int64_t host_ns = 0;
  std::shared_ptr<const Bytes> cdr;
};

/// Turns what the robot says into ROS 2 messages on the topics of docs/formats/recording.md. Pictures become
/// JPEG. Frames are said as well: map, odom, base_link and the camera's.
class LiveChannels {
 public:
  /// Messages of the sample; of a channel that nobody `wants` none is encoded, but the channel becomes known.
  [[nodiscard]] std::vector<LiveMessage> encode(const LiveSample& sample,
                                                const std::set<std::uint32_t>& wanted);
  [[nodiscard]] std::vector<LiveMessage> encode(const LiveFeed::Mounted& camera, std::int64_t host_ns);
  [[nodiscard]] std::vector<LiveMessage> encode(const ros2::MarkerArray& shapes, std::int64_t host_ns);
  /// An object that is written already, on a latched channel of JSON.
  [[nodiscard]] LiveMessage encode_json(const std::string& topic, std::string_view object,
                                        std::int64_t host_ns);

  /// All that are known so far; ids are places in it.
  [[nodiscard]] const std::vector<LiveChannel>& known() const { return known_; }
  /// The last message of a latched channel; nullptr where there is none.
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
