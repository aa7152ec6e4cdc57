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

/// Opens a serial port (or a pseudo-terminal) for this process alone and sets it to 460800 baud, 8 bits, no
/// parity, one stop bit, raw. Neither reading nor writing waits. Errors: NotFound (no such port, and which
/// there are), Unreadable (no permission, and of which group to be; in use, and by whom), Unsupported (no
/// serial port).
[[nodiscard]] Result<Descriptor> open_serial_port(const std::string& path);

/// The ports of this computer at which a LIMO may be, by path.
[[nodiscard]] std::vector<std::string> list_serial_ports();

/// What came over LIMO's port while nothing was sent.
struct LimoHeard {
  std::uint64_t bytes = 0;
  std::uint64_t skipped_bytes = 0;  ///< belonged to no frame
  std::uint64_t frames = 0;
  double motion_rate_hz = 0;         ///< of 0x221
  double gyro_rate_hz = 0;           ///< of 0x322
  std::optional<LimoState> state{};  ///< the newest
};

/// Opens the port and listens for so long, or until it is `cancelled`. Sends nothing: a LIMO that somebody
/// drives is left alone. Errors: as open_serial_port(); Unreadable where the port is cut.
[[nodiscard]] Result<LimoHeard> listen_to_limo(const std::string& port, Duration listen,
                                               const std::function<bool()>& cancelled);

}  // namespace waymark
