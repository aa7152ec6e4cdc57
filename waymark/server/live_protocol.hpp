#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/server/health.hpp"
#include "waymark/server/live_channels.hpp"
#include "waymark/server/live_feed.hpp"

namespace waymark {

// Messages from viewers. Text is a JSON object with "op", as in the Foxglove WebSocket protocol
// (foxglove/ws-protocol, docs/spec.md, "Messages sent by the client"). The page adds: take, release, alive,
// order, drive, camera (docs/formats/live.md).

struct ClientSubscribe {
  struct One {
    std::uint32_t subscription = 0;
    std::uint32_t channel = 0;
  };
  std::vector<One> wanted{};
};
struct ClientUnsubscribe {
  std::vector<std::uint32_t> subscriptions{};
};
/// A channel on which the client will publish.
struct ClientAdvertise {
  struct One {
    std::uint32_t channel = 0;
    std::string topic{};
    std::string encoding{};
  };
  std::vector<One> channels{};
};
struct ClientUnadvertise {
  std::vector<std::uint32_t> channels{};
};
struct ClientTakes {};     ///< control
struct ClientReleases {};  ///< control
struct ClientAlive {};
struct ClientOrders {
  ViewerOrder order{};
};
/// An unsupported message of the protocol.
struct ClientUnsupported {
  std::string op{};
};

using ClientMessage = std::variant<ClientSubscribe, ClientUnsubscribe, ClientAdvertise, ClientUnadvertise,
                                   ClientTakes, ClientReleases, ClientAlive, ClientOrders, ClientUnsupported>;

/// Fails if the text is not a message of the protocol. Lists have at most kMaxNamed entries.
[[nodiscard]] Result<ClientMessage> parse_client_text(std::string_view text);
inline constexpr std::size_t kMaxNamed = 1024;

/// A published message: opcode 1, the client's channel (little-endian), the message.
struct ClientPublishes {
  std::uint32_t channel = 0;
  std::span<const std::uint8_t> message{};
};
[[nodiscard]] Result<ClientPublishes> parse_client_binary(std::span<const std::uint8_t> bytes);

/// Topics on which Foxglove may publish, as JSON: an order as text ({"data": "stop"}, std_msgs/String), and a
/// velocity (geometry_msgs/Twist).
inline constexpr std::string_view kOrderTopic = "/waymark/order";
inline constexpr std::string_view kDriveTopic = "/cmd_vel";
[[nodiscard]] Result<ViewerOrder> parse_published(std::string_view topic, std::string_view json);

// Messages of the server to viewers, as text: the Foxglove WebSocket protocol (foxglove/ws-protocol,
// docs/spec.md, "Messages sent by the server") and additions for the page (docs/formats/live.md).

[[nodiscard]] std::string server_info(std::string_view name);
[[nodiscard]] std::string advertisement(std::span<const LiveChannel> channels);
/// A warning as text.
[[nodiscard]] std::string status_message(std::string_view words);
/// Opcode 1, subscription, time [ns]; the message follows. All numbers are little-endian.
[[nodiscard]] std::string message_head(std::uint32_t subscription, std::int64_t host_ns);

/// A file of the map folder, for the page.
[[nodiscard]] std::string text_message(std::string_view name, std::string_view text);
/// The state of the robot, for all viewers: topic /waymark/state.
[[nodiscard]] std::string state_json(const LiveStatus& status, const std::vector<HealthLight>& lights,
                                     std::uint64_t dropped);

struct ControlState {
  bool may = false;    ///< may command, because it has the token
  bool yours = false;  ///< this viewer holds control
  bool held = false;   ///< some viewer holds control
  std::size_t viewers = 0;
  std::uint64_t dropped = 0;  ///< frames dropped because this viewer was too slow
};
[[nodiscard]] std::string control_json(const ControlState& state);

}  // namespace waymark
