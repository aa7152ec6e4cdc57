#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"

/// Publishes and subscribes over DDS, independently of the DDS implementation. Messages are bytes as sent by
/// ROS 2 programs: CDR preceded by the four-byte encapsulation header.
namespace waymark {

/// The quality of service that decides which endpoints match (DDS 1.4, section 2.2.3), and the history depth.
struct TopicQos {
  bool reliable = true;          ///< a reliable subscription does not match a best-effort publisher
  bool transient_local = false;  ///< late joiners receive the last `depth` messages
  int depth = 10;                ///< number of messages kept
  bool large = false;  ///< publishers only: messages larger than 64 kB, sent in fragments by a thread

  friend bool operator==(const TopicQos&, const TopicQos&) = default;
};

/// A topic and its type by their DDS names: "rt/odom", "nav_msgs::msg::dds_::Odometry_".
struct BusTopic {
  std::string topic{};
  std::string type{};
};

/// Identifies a participant, a publisher or a subscription (RTPS 2.2, section 8.2.4.1).
using Guid = std::array<std::uint8_t, 16>;

/// This participant and its publishers and subscriptions.
struct OwnEndpoints {
  Guid participant{};
  std::vector<Guid> publishers{};
  std::vector<Guid> subscriptions{};
};

/// A message that describes this participant to others. It is kept for late joiners and published again
/// whenever a publisher or subscription is added or removed.
struct SelfDescription {
  BusTopic name{};
  std::function<std::vector<std::uint8_t>(const OwnEndpoints&)> bytes{};
};

/// The domain to join and where to look for other participants.
struct BusOptions {
  int domain = 0;
  bool localhost_only = false;
  std::vector<std::string> interfaces{};  ///< IPv4 addresses of the network interfaces; all if empty
  std::vector<std::string> peers{};       ///< IPv4 addresses to contact in addition to multicast
  std::string node = "waymark";
  std::string keystore{};     ///< folder with the enclave's certificates (SROS 2); no security if empty
  std::string enclave = "/";  ///< enclave name announced by ROS 2 participants
  std::optional<SelfDescription> self{};
};

/// The request to which a reply belongs: the sequence number and GUID of its RTPS writer, or the GUID of the
/// client's reader if the request contains it.
struct RequestIdentity {
  Guid guid{};
  std::int64_t sequence = 0;
};

struct BusMessage {
  std::size_t subscription = 0;  ///< number returned by subscribe()
  std::vector<std::uint8_t> bytes{};
  Duration arrived{};  ///< time on the steady clock
  RequestIdentity identity{};
};

/// A publisher or subscription of another participant.
struct BusEndpoint {
  bool publishes = false;
  BusTopic name{};
  TopicQos qos{};  ///< only reliable and transient_local
  Guid guid{};
};

/// A participant: one program on the network with any number of publishers and subscriptions. All functions
/// must be called from the same thread; messages arrive on other threads.
class Bus {
 public:
  virtual ~Bus() = default;
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  /// Adds a publisher and returns its number. Fails if the topic is already used with a different type.
  virtual Result<std::size_t> advertise(const BusTopic& topic, const TopicQos& qos) = 0;
  /// Adds a subscription and returns its number. At most `qos.depth` of its messages are queued; when the
  /// queue is full, the oldest messages are dropped and counted.
  virtual Result<std::size_t> subscribe(const BusTopic& topic, const TopicQos& qos) = 0;
  /// Ends a subscription. next() may still return messages queued for it; its number is not reused.
  virtual void unsubscribe(std::size_t subscription) = 0;
  virtual Status publish(std::size_t publisher, std::span<const std::uint8_t> bytes) = 0;
  /// Publishes the message as the reply to a request.
  virtual Status reply(std::size_t publisher, std::span<const std::uint8_t> bytes,
                       const RequestIdentity& to) = 0;
  /// The oldest queued message; `nullopt` if none arrives within `timeout`.
  virtual std::optional<BusMessage> next(Duration timeout) = 0;
  [[nodiscard]] virtual bool more() const = 0;
  /// Number of subscriptions that match a publisher, or of publishers that match a subscription.
  [[nodiscard]] virtual int matched_subscriptions(std::size_t publisher) const = 0;
  [[nodiscard]] virtual int matched_publishers(std::size_t subscription) const = 0;
  [[nodiscard]] virtual std::uint64_t dropped(std::size_t subscription) const = 0;
  /// Publishers and subscriptions of other participants discovered so far.
  [[nodiscard]] virtual std::vector<BusEndpoint> endpoints() const = 0;
  /// Names of the other participants.
  [[nodiscard]] virtual std::vector<std::string> participants() const = 0;
  /// The name of the participant that owns this publisher or subscription; empty if it has not been
  /// discovered.
  [[nodiscard]] virtual std::string participant_of(const Guid& endpoint) const = 0;

 protected:
  Bus() = default;
};

/// Type and symbol of the function exported by the module that contains the DDS implementation. A C function
/// cannot return a `Result`, so it stores the bus or the error in its arguments.
using OpenBusFunction = void (*)(const BusOptions&, std::unique_ptr<Bus>&, Error&);
inline constexpr const char* kOpenBusSymbol = "waymark_open_bus";

/// Joins the domain. The first call loads the module libwaymark-dds.so from the folder of the program or from
/// ../lib/waymark. Fails if the module is missing or cannot be loaded, or if the domain cannot be joined.
[[nodiscard]] Result<std::unique_ptr<Bus>> open_bus(const BusOptions& options);
/// Joins the domain specified by the ROS environment variables (apply_ros_environment()).
[[nodiscard]] Result<std::unique_ptr<Bus>> open_bus();

}  // namespace waymark
