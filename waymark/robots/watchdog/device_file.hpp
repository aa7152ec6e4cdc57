#pragma once

#include <string>

#include "waymark/base/error.hpp"

/// Device files below /dev.
namespace waymark {

/// The process of this user that has the device file open, as "cheese (process 4711)"; a process that locked
/// it (flock) takes precedence. Empty if no process other than this one has it open. Without `maker_counts`,
/// the process that created a pseudo-terminal is ignored.
[[nodiscard]] std::string holder_of(const std::string& path, bool maker_counts = true);

/// The error that this user has no permission to open the file, with the required group and the command to
/// join it. `what`: its name, such as "the camera"; `hint`: used if the file has no named group.
[[nodiscard]] Error no_permission(const std::string& path, const std::string& what, const std::string& hint);

}  // namespace waymark
