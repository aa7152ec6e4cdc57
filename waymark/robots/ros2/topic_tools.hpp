#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/dds/ros_names.hpp"

/// Diagnostics for a ROS 2 network: its topics, their messages and their rates.
namespace waymark {

/// The fields of a message in plain little-endian CDR as lines "name: value", indented as by `ros2 topic
/// echo`. Lists longer than `max_elements` are truncated and shown with their length. Fails if the type is
/// unknown or the data is truncated.
[[nodiscard]] Result<std::string> message_text(std::string_view type, std::span<const std::uint8_t> cdr,
                                               std::size_t max_elements = 12);

/// A topic with the numbers of its publishers and subscriptions.
struct TopicListing {
  std::string topic{};
  std::string type{};
  int publishers = 0;
  int subscriptions = 0;
  std::string offered{};  ///< quality of service offered by the publishers: "reliable", "best effort,
                          ///< transient local", …
};

/// The ROS topics among the endpoints, sorted by name; a topic with two types is listed twice.
[[nodiscard]] std::vector<TopicListing> list_topics(const std::vector<BusEndpoint>& endpoints);

/// Formats a listing as "/odom [nav_msgs/msg/Odometry] 1 publisher (reliable), 0 subscriptions".
[[nodiscard]] std::string to_text(const TopicListing& listing);

/// Waits until nothing new has been discovered for half a second, or until `timeout`.
void wait_for_discovery(const Bus& bus, Duration timeout, const std::function<bool()>& should_stop);

/// Subscribes to a published topic with the quality of service used by its publishers. Fails if no publisher
/// is found within `timeout` (NotFound, suggests the nearest name), if the topic has two types (Unsupported),
/// or if the name is invalid (InvalidArgument).
struct WatchedTopic {
  RosTopic name{};
  std::size_t subscription = 0;
};
[[nodiscard]] Result<WatchedTopic> watch_topic(Bus& bus, const std::string& topic, Duration timeout,
                                               const std::function<bool()>& should_stop);

/// Limits after which watching a topic ends.
struct WatchLimits {
  int messages = 0;                             ///< 0 if unlimited
  double duration_s = 0;                        ///< 0 if unlimited
  Duration patience = std::chrono::seconds(3);  ///< how long to wait for a publisher

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.messages, JobField("count INTEGER", "Stop after this number of messages; 0: run until Ctrl-C",
                                  0, 1'000'000'000));
    visit(self.duration_s,
          JobField("seconds FLOAT", "Stop after this time [s]; 0: run until Ctrl-C", 0.0, 1e9));
  }
};
/// Passes each message on a topic to `take` until a limit is reached, should_stop() returns true, or `take`
/// fails. Fails if the topic has no publisher or no message has arrived.
[[nodiscard]] Status watch_messages(
    Bus& bus, const std::string& topic, const WatchLimits& limits, const std::function<bool()>& should_stop,
    const std::function<Status(const WatchedTopic&, const BusMessage&)>& take);

/// Measures the rate at which messages arrive.
class RateCounter {
 public:
  void add(Duration arrived, std::size_t bytes);
  /// Text such as "29.98 Hz, 9.21 MB/s, 33.3 ms apart (from 31.0 to 36.2), 120 messages"; "no message" if
  /// there are fewer than two.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] double rate_hz() const;

 private:
  std::size_t count_ = 0;
  std::size_t bytes_ = 0;
  Duration first_{};
  Duration last_{};
  Duration shortest_ = Duration::max();
  Duration longest_{};
};

}  // namespace waymark
