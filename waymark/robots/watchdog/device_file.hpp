#pragma once

#include <string>

#include "waymark/base/error.hpp"

/// Device files below /dev.
namespace waymark {

/// The process of this user that has the device file open, as "cheese (process 4711)"; a process that has
/// locked it (flock) takes precedence. Empty if no other process has it open. Without `maker_counts`, the
/// process that created a pseudo-terminal is ignored.
[[nodiscard]] std::string holder_of(const std::string& path, bool maker_counts = true);

/// The error for missing permission to open the file, with the required group and the command to join it.
/// `what` is its name, such as "the camera"; `hint` is used if the file's group has no name.
[[nodiscard]] Error no_permission(const std::string& path, const std::string& what, const std::string& hint);

}  // namespace waymark
