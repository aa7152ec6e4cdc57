#pragma once

#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {

/// Opens a serial port (or a pseudo-terminal) for this process alone and sets it to 460800 baud, 8 bits, no
/// parity, one stop bit, raw. Neither reading nor writing waits. Errors: NotFound (no such port, and which
/// there are), Unreadable (no permission, and of which group to be; in use, and by whom), Unsupported (no
/// serial port).
[[nodiscard]] Result<Descriptor> open_serial_port(const std::string& path);

/// The ports of this computer at which a LIMO may be, by path.
[[nodiscard]] std::vector<std::string> list_serial_ports();

}  // namespace waymark
