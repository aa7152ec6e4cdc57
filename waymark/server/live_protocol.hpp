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

// Messages from viewers. A text message is a JSON object with "op", as in the Foxglove WebSocket protocol
// (foxglove/ws-protocol, docs/spec.md, "Messages sent by the client"). The page adds take, release, alive,
// order, drive and camera (docs/formats/live.md).

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
/// A channel on which the client is going to publish.
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
struct ClientTakes {};     ///< Takes control.
struct ClientReleases {};  ///< Releases control.
struct ClientAlive {};
struct ClientOrders {
  ViewerOrder order{};
};
/// A protocol message that is not supported.
struct ClientUnsupported {
  std::string op{};
};

using ClientMessage = std::variant<ClientSubscribe, ClientUnsubscribe, ClientAdvertise, ClientUnadvertise,
                                   ClientTakes, ClientReleases, ClientAlive, ClientOrders, ClientUnsupported>;

/// Fails if the text is not a protocol message. Lists may have at most kMaxNamed entries.
[[nodiscard]] Result<ClientMessage> parse_client_text(std::string_view text);
inline constexpr std::size_t kMaxNamed = 1024;

/// A published message. It consists of opcode 1, the client's channel (little-endian), and the message.
struct ClientPublishes {
  std::uint32_t channel = 0;
  std::span<const std::uint8_t> message{};
};
[[nodiscard]] Result<ClientPublishes> parse_client_binary(std::span<const std::uint8_t> bytes);

/// Topics on which Foxglove may publish JSON messages: an order as text ({"data": "stop"}, std_msgs/String),
/// and a velocity (geometry_msgs/Twist).
inline constexpr std::string_view kOrderTopic = "/waymark/order";
inline constexpr std::string_view kDriveTopic = "/cmd_vel";
[[nodiscard]] Result<ViewerOrder> parse_published(std::string_view topic, std::string_view json);

// Messages from the server to viewers, as text. They follow the Foxglove WebSocket protocol
// (foxglove/ws-protocol, docs/spec.md, "Messages sent by the server"), with additions for the page
// (docs/formats/live.md).

[[nodiscard]] std::string server_info(std::string_view name);
[[nodiscard]] std::string advertisement(std::span<const LiveChannel> channels);
/// A warning message with this text.
[[nodiscard]] std::string status_message(std::string_view words);
/// The head of a message: opcode 1, subscription, time [ns]. The content follows. All numbers are
/// little-endian.
[[nodiscard]] std::string message_head(std::uint32_t subscription, std::int64_t host_ns);

/// A message with a file from the map folder, for the page.
[[nodiscard]] std::string text_message(std::string_view name, std::string_view text);
/// The state of the robot, sent to all viewers on the topic /waymark/state.
[[nodiscard]] std::string state_json(const LiveStatus& status, const std::vector<HealthLight>& lights,
                                     std::uint64_t dropped);

struct ControlState {
  bool may = false;    ///< whether the viewer may send commands, because it has the token
  bool yours = false;  ///< whether this viewer is in control
  bool held = false;   ///< whether any viewer is in control
  std::size_t viewers = 0;
  std::uint64_t dropped = 0;  ///< number of frames dropped because this viewer was too slow
};
[[nodiscard]] std::string control_json(const ControlState& state);

}  // namespace waymark
