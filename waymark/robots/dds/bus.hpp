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

/// Publishing and subscribing over DDS, whatever implements it. Messages are bytes: CDR with its four bytes
/// of encapsulation, as a ROS 2 program sends them.
namespace waymark {

/// The qualities of service that decide who matches whom (DDS 1.4, section 2.2.3), and how much is kept.
struct TopicQos {
  bool reliable = true;          ///< a subscription that asks for it matches no best-effort publisher
  bool transient_local = false;  ///< late joiners get the last `depth` messages
  int depth = 10;                ///< messages kept
  bool large = false;            ///< of a publisher: messages above 64 kB, sent in fragments by a thread

  friend bool operator==(const TopicQos&, const TopicQos&) = default;
};

/// Topic and type as DDS names them: "rt/odom", "nav_msgs::msg::dds_::Odometry_".
struct BusTopic {
  std::string topic{};
  std::string type{};
};

/// Of a participant, a publisher or a subscription (RTPS 2.2, section 8.2.4.1).
using Guid = std::array<std::uint8_t, 16>;

/// This participant, what it publishes and what it subscribes to.
struct OwnEndpoints {
  Guid participant{};
  std::vector<Guid> publishers{};
  std::vector<Guid> subscriptions{};
};

/// A message that tells others what this participant has: kept for late joiners, and published anew each time
/// that a publisher or a subscription was added or ended.
struct SelfDescription {
  BusTopic name{};
  std::function<std::vector<std::uint8_t>(const OwnEndpoints&)> bytes{};
};

/// Where to look for others.
struct BusOptions {
  int domain = 0;
  bool localhost_only = false;
  std::vector<std::string> interfaces{};  ///< IPv4 addresses of the network interfaces; empty: all
  std::vector<std::string> peers{};       ///< IPv4 addresses that are asked beside multicast
  std::string node = "waymark";
  std::string keystore{};     ///< folder of the enclave's certificates (SROS 2); empty: no security
  std::string enclave = "/";  ///< its name, which participants of ROS 2 tell
  std::optional<SelfDescription> self{};
};

/// Which request a reply answers: writer's GUID (of the client's reader, where the request names it) and
/// sequence number, as RTPS has them.
struct RequestIdentity {
  Guid guid{};
  std::int64_t sequence = 0;
};

struct BusMessage {
  std::size_t subscription = 0;  ///< as subscribe() numbered it
  std::vector<std::uint8_t> bytes{};
  Duration arrived{};  ///< steady clock
  RequestIdentity identity{};
};

/// A publisher or a subscription of somebody else.
struct BusEndpoint {
  bool publishes = false;
  BusTopic name{};
  TopicQos qos{};  ///< reliable and transient_local only
  Guid guid{};
};

/// A participant: one program on the network, with as many publishers and subscriptions as it needs. All
/// functions may be called from one thread; messages arrive on others.
class Bus {
 public:
  virtual ~Bus() = default;
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  /// The number of a new publisher. Fails when the topic is already used with another type.
  virtual Result<std::size_t> advertise(const BusTopic& topic, const TopicQos& qos) = 0;
  /// The number of a new subscription, of which at most `qos.depth` messages wait to be taken; the oldest
  /// are dropped and counted.
  virtual Result<std::size_t> subscribe(const BusTopic& topic, const TopicQos& qos) = 0;
  /// Ends a subscription; what waits of it may still come. Its number is not used again.
  virtual void unsubscribe(std::size_t subscription) = 0;
  virtual Status publish(std::size_t publisher, std::span<const std::uint8_t> bytes) = 0;
  /// The same as the reply to a request.
  virtual Status reply(std::size_t publisher, std::span<const std::uint8_t> bytes,
                       const RequestIdentity& to) = 0;
  /// The oldest message that waits; nothing: none came within `most`.
  virtual std::optional<BusMessage> next(Duration most) = 0;
  [[nodiscard]] virtual bool more() const = 0;
  /// Subscriptions that a publisher matches; publishers that a subscription matches.
  [[nodiscard]] virtual int matched_subscriptions(std::size_t publisher) const = 0;
  [[nodiscard]] virtual int matched_publishers(std::size_t subscription) const = 0;
  [[nodiscard]] virtual std::uint64_t dropped(std::size_t subscription) const = 0;
  /// What others publish and subscribe to, as far as it was discovered.
  [[nodiscard]] virtual std::vector<BusEndpoint> endpoints() const = 0;
  /// Names of the other participants.
  [[nodiscard]] virtual std::vector<std::string> participants() const = 0;
  /// The name of the participant that has this publisher or subscription; empty: none that was discovered.
  [[nodiscard]] virtual std::string participant_of(const Guid& endpoint) const = 0;

 protected:
  Bus() = default;
};

/// The function that the module with the DDS implementation exports, and its name there. `Result` crosses no
/// border of C: the bus, or the error, is put where the arguments say.
using OpenBusFunction = void (*)(const BusOptions&, std::unique_ptr<Bus>&, Error&);
inline constexpr const char* kOpenBusSymbol = "waymark_open_bus";

/// Joins the domain. The module libwaymark-dds.so is loaded by the first call: beside the program that runs,
/// or in ../lib/waymark. Fails where it is not there, cannot be loaded, or cannot join.
[[nodiscard]] Result<std::unique_ptr<Bus>> open_bus(const BusOptions& options);
/// As the environment variables of ROS say (apply_ros_environment()).
[[nodiscard]] Result<std::unique_ptr<Bus>> open_bus();

}  // namespace waymark
