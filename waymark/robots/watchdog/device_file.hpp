#pragma once

#include <string>

#include "waymark/base/error.hpp"

/// The file of a device, below /dev.
namespace waymark {

/// "cheese (process 4711)" where another process of this user has the file open, the one that locked it
/// (flock) before all others; empty where none is found. A process that has made the file, a pseudo-terminal,
/// is not asked for where `maker_counts` is false.
[[nodiscard]] std::string holder_of(const std::string& path, bool maker_counts = true);

/// That this user may not open the file, of which group he must be, and how he gets there. `what` it is:
/// "the camera"; `hint` where the file has no group with a name.
[[nodiscard]] Error no_permission(const std::string& path, const std::string& what, const std::string& hint);

}  // namespace waymark
