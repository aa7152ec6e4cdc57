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

/// First aid on a network of ROS 2: what is there, what it says, how often.
namespace waymark {

/// The fields of a message in plain little-endian CDR as lines "name: value", indented as `ros2 topic echo`
/// has them; of lists longer than `most_elements` the first ones and their number. Fails on a type whose
/// definition is not known here, and on bytes that end too early.
[[nodiscard]] Result<std::string> message_text(std::string_view type, std::span<const std::uint8_t> cdr,
                                               std::size_t most_elements = 12);

/// A topic and who uses it.
struct TopicListing {
  std::string topic{};
  std::string type{};
  int publishers = 0;
  int subscriptions = 0;
  std::string offered{};  ///< of the publishers: "reliable", "best effort, transient local", …
};

/// The topics of ROS among the endpoints, by name; one that is used with two types stands twice.
[[nodiscard]] std::vector<TopicListing> list_topics(const std::vector<BusEndpoint>& endpoints);

/// "/odom [nav_msgs/msg/Odometry] 1 publisher (reliable), 0 subscriptions".
[[nodiscard]] std::string to_text(const TopicListing& listing);

/// Waits until nothing new was discovered for half a second, or for `most`.
void wait_for_discovery(const Bus& bus, Duration most, const std::function<bool()>& should_stop);

/// Subscribes to a topic that somebody publishes, as its publishers offer it. Fails, and names the nearest,
/// when nobody does within `most` (NotFound), with two types (Unsupported), and where the name is none
/// (InvalidArgument).
struct WatchedTopic {
  RosTopic name{};
  std::size_t subscription = 0;
};
[[nodiscard]] Result<WatchedTopic> watch_topic(Bus& bus, const std::string& topic, Duration most,
                                               const std::function<bool()>& should_stop);

/// How long a topic is listened to.
struct WatchLimits {
  int messages = 0;                             ///< 0: any number
  double duration_s = 0;                        ///< 0: without an end
  Duration patience = std::chrono::seconds(3);  ///< until somebody publishes it

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.messages,
          JobField("count INTEGER", "End after so many messages; 0: go on until Ctrl-C", 0, 1'000'000'000));
    visit(self.duration_s, JobField("seconds FLOAT", "End after so long; 0: go on until Ctrl-C", 0.0, 1e9));
  }
};
/// Gives each message of a topic to `take` until the limits, should_stop(), or an error of `take`. Fails
/// where nobody publishes the topic, and where no message came.
[[nodiscard]] Status watch_messages(
    Bus& bus, const std::string& topic, const WatchLimits& limits, const std::function<bool()>& should_stop,
    const std::function<Status(const WatchedTopic&, const BusMessage&)>& take);

/// How often messages came, as they are counted.
class RateCounter {
 public:
  void add(Duration arrived, std::size_t bytes);
  /// "29.98 Hz, 9.21 MB/s, 33.3 ms apart (from 31.0 to 36.2), 120 messages"; "no message" for less than two.
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
