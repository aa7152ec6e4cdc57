#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/server/health.hpp"
#include "waymark/server/live_channels.hpp"

/// What the server says to viewers, as text: the Foxglove WebSocket protocol (foxglove/ws-protocol,
/// docs/spec.md, "Messages sent by the server") and what the page needs beside it (docs/formats/live.md).
namespace waymark {

[[nodiscard]] std::string server_info(std::string_view name);
[[nodiscard]] std::string advertisement(std::span<const LiveChannel> channels);
/// A warning in words.
[[nodiscard]] std::string status_message(std::string_view words);
/// Opcode 1, subscription, time [ns]; the message follows. All little endian.
[[nodiscard]] std::string message_head(std::uint32_t subscription, std::int64_t host_ns);

/// A file of the map, for the page.
[[nodiscard]] std::string text_message(std::string_view name, std::string_view text);
/// The state of the robot, for everybody: topic /waymark/state.
[[nodiscard]] std::string state_json(const LiveStatus& status, const std::vector<HealthLight>& lights,
                                     std::uint64_t dropped);

struct ControlWords {
  bool may = false;    ///< command, with the token
  bool yours = false;  ///< the control is with this viewer
  bool held = false;   ///< by anybody
  std::size_t viewers = 0;
  std::uint64_t dropped = 0;  ///< frames that this viewer was too slow for
};
[[nodiscard]] std::string control_json(const ControlWords& words);

}  // namespace waymark
