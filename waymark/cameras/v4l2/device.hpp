#pragma once

#include <string>
#include <utility>

#include "waymark/base/error.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

/// A Video4Linux device node and its ioctl calls.
namespace waymark::internal {

/// The call, repeated where a signal interrupted it; errno on failure, 0 otherwise.
[[nodiscard]] int control_device(int device, unsigned long request, void* argument);

/// Opens the node without waiting. NotFound (no such node), Unreadable (no permission, with the group that
/// has it; not a device), Unsupported (no camera).
[[nodiscard]] Result<Descriptor> open_device(const std::string& path);

/// An errno of a call on this device in words: busy (and by which process), unplugged, …
[[nodiscard]] Error device_error(const std::string& path, const std::string& what, int error);

}  // namespace waymark::internal
