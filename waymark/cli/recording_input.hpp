#pragma once

#include <cstddef>
#include <string>

#include "waymark/cli/detect_all.hpp"

namespace waymark::cli {

/// Whether a file begins as a recording does (MCAP, rosbag2, ROS 1 bag, LCM), or as a packed one may. Reads a
/// few bytes of a regular file; pipes are left alone.
[[nodiscard]] bool looks_like_recording(const std::string& path);

/// Finds the tags in every picture of a recording, as detect_all() does for files. Pictures are named
/// FILE#SECONDS after their stamp.
void detect_recording(std::size_t index, const std::string& path, const TagFinder& finder, Console& console,
                      const EachPicture& each, DetectSummary& summary);

}  // namespace waymark::cli
