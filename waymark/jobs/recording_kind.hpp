#pragma once

#include <string>

namespace waymark {

/// Whether a file begins as a recording does (MCAP, rosbag2, ROS 1 bag, LCM), or as a packed one may. Reads a
/// few bytes of a regular file; pipes are left alone.
[[nodiscard]] bool looks_like_recording(const std::string& path);

}  // namespace waymark
