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

/// Publishes and subscribes over DDS, independently of the implementation. Messages are bytes as a ROS 2
/// program sends them: CDR with its four bytes of encapsulation.
namespace waymark {

/// The quality of service that decides which endpoints match (DDS 1.4, section 2.2.3), and the history depth.
struct TopicQos {
  bool reliable = true;          ///< a reliable subscription does not match a best-effort publisher
  bool transient_local = false;  ///< late joiners get the last `depth` messages
  int depth = 10;                ///< messages kept
  bool large = false;            ///< publishers only: messages above 64 kB, sent in fragments by a thread

  friend bool operator==(const TopicQos&, const TopicQos&) = default;
};

/// Topic and type with their DDS names: "rt/odom", "nav_msgs::msg::dds_::Odometry_".
struct BusTopic {
  std::string topic{};
  std::string type{};
};

/// Identifies a participant, a publisher or a subscription (RTPS 2.2, section 8.2.4.1).
using Guid = std::array<std::uint8_t, 16>;

/// This participant with its publishers and subscriptions.
struct OwnEndpoints {
  Guid participant{};
  std::vector<Guid> publishers{};
  std::vector<Guid> subscriptions{};
};

/// A message that describes this participant to others. It is kept for late joiners, and published again
/// whenever a publisher or a subscription is added or removed.
struct SelfDescription {
  BusTopic name{};
  std::function<std::vector<std::uint8_t>(const OwnEndpoints&)> bytes{};
};

/// The domain to join and where to look for other participants.
struct BusOptions {
  int domain = 0;
  bool localhost_only = false;
  std::vector<std::string> interfaces{};  ///< IPv4 addresses of the network interfaces; empty: all
  std::vector<std::string> peers{};       ///< IPv4 addresses contacted in addition to multicast
  std::string node = "waymark";
  std::string keystore{};     ///< folder of the enclave's certificates (SROS 2); empty: no security
  std::string enclave = "/";  ///< enclave name, which ROS 2 participants announce
  std::optional<SelfDescription> self{};
};

/// The request that a reply answers: sequence number and GUID of its writer in RTPS, or the GUID of the
/// client's reader if the request contains it.
struct RequestIdentity {
  Guid guid{};
  std::int64_t sequence = 0;
};

struct BusMessage {
  std::size_t subscription = 0;  ///< number from subscribe()
  std::vector<std::uint8_t> bytes{};
  Duration arrived{};  ///< steady clock
  RequestIdentity identity{};
};

/// A publisher or a subscription of another participant.
struct BusEndpoint {
  bool publishes = false;
  BusTopic name{};
  TopicQos qos{};  ///< reliable and transient_local only
  Guid guid{};
};

/// A participant: one program on the network with any number of publishers and subscriptions. All functions
/// must be called from one thread; messages arrive on others.
class Bus {
 public:
  virtual ~Bus() = default;
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  /// Adds a publisher and returns its number. Fails if the topic is already used with another type.
  virtual Result<std::size_t> advertise(const BusTopic& topic, const TopicQos& qos) = 0;
  /// Adds a subscription and returns its number. At most `qos.depth` of its messages are queued; when the
  /// queue is full, the oldest are dropped and counted.
  virtual Result<std::size_t> subscribe(const BusTopic& topic, const TopicQos& qos) = 0;
  /// Ends a subscription. next() may still return its queued messages; its number is not used again.
  virtual void unsubscribe(std::size_t subscription) = 0;
  virtual Status publish(std::size_t publisher, std::span<const std::uint8_t> bytes) = 0;
  /// Publishes the message as the reply to a request.
  virtual Status reply(std::size_t publisher, std::span<const std::uint8_t> bytes,
                       const RequestIdentity& to) = 0;
  /// The oldest queued message; empty if none arrives within `timeout`.
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
  /// The name of the participant with this publisher or subscription; empty if it was not discovered.
  [[nodiscard]] virtual std::string participant_of(const Guid& endpoint) const = 0;

 protected:
  Bus() = default;
};

/// Type and symbol of the function that the module with the DDS implementation exports. A C function cannot
/// return a `Result`, so it stores the bus, or the error, in its arguments.
using OpenBusFunction = void (*)(const BusOptions&, std::unique_ptr<Bus>&, Error&);
inline constexpr const char* kOpenBusSymbol = "waymark_open_bus";

/// Joins the domain. The first call loads the module libwaymark-dds.so from the program's folder or from
/// ../lib/waymark. Fails if the module is missing or cannot be loaded, or if the domain cannot be joined.
[[nodiscard]] Result<std::unique_ptr<Bus>> open_bus(const BusOptions& options);
/// Joins the domain that the ROS environment variables specify (apply_ros_environment()).
[[nodiscard]] Result<std::unique_ptr<Bus>> open_bus();

}  // namespace waymark
