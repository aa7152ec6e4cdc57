#pragma once

#include <string>

#include "waymark/base/error.hpp"

/// The file of a device, below /dev.
namespace waymark {

/// The process of this user that has the device file open, "cheese (process 4711)"; a process that locked it
/// (flock) comes first. Empty if there is none, except this process. Without `maker_counts`, the process that
/// created a pseudo-terminal is ignored.
[[nodiscard]] std::string holder_of(const std::string& path, bool maker_counts = true);

/// The error that this user has no permission to open the file, with the required group and the command to
/// join it. `what`: its name, such as "the camera"; `hint`: used if the file has no named group.
[[nodiscard]] Error no_permission(const std::string& path, const std::string& what, const std::string& hint);

}  // namespace waymark
