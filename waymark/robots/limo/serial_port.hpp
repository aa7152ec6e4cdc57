#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/robots/limo/limo_messages.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {

/// Opens a serial port (or a pseudo-terminal) exclusively and sets it to 460800 baud, 8 bits, no parity, one
/// stop bit, raw and non-blocking. Errors: NotFound (no such port; lists those available), Unreadable (no
/// permission, with the required group; or in use, with the program that uses it), Unsupported (not a serial
/// port).
[[nodiscard]] Result<Descriptor> open_serial_port(const std::string& path);

/// Paths of the ports on this computer to which a LIMO may be connected, sorted.
[[nodiscard]] std::vector<std::string> list_serial_ports();

/// Data received on LIMO's port while nothing was sent.
struct LimoPortActivity {
  std::uint64_t bytes = 0;
  std::uint64_t skipped_bytes = 0;  ///< number of bytes outside frames
  std::uint64_t frames = 0;
  double motion_rate_hz = 0;         ///< rate of 0x221
  double gyro_rate_hz = 0;           ///< rate of 0x322
  std::optional<LimoState> state{};  ///< newest state
};

/// Opens the port and listens for the duration `listen`, or until `cancelled` returns true. Sends nothing, so
/// a LIMO in use is not disturbed. Errors: those of open_serial_port(); Unreadable if the port is
/// disconnected.
[[nodiscard]] Result<LimoPortActivity> listen_to_limo(const std::string& port, Duration listen,
                                                      const std::function<bool()>& cancelled);

}  // namespace waymark
