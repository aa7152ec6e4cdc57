#pragma once

#include <string>
#include <utility>

#include "waymark/base/error.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

/// A Video4Linux device node and its ioctl calls.
namespace waymark::internal {

/// Calls ioctl() and repeats the call if a signal interrupts it. Returns errno on failure, otherwise 0.
[[nodiscard]] int control_device(int device, unsigned long request, void* argument);

/// Opens the node in non-blocking mode. Errors: NotFound (no such node), Unreadable (no permission; the error
/// names the required group), Unsupported (not a device).
[[nodiscard]] Result<Descriptor> open_device(const std::string& path);

/// The error for an errno returned by a call on this device, such as busy (naming the process that uses it)
/// or unplugged. For any other errno, `what` describes the call.
[[nodiscard]] Error device_error(const std::string& path, const std::string& what, int error);

}  // namespace waymark::internal
