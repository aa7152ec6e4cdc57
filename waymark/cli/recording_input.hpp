#pragma once

#include <cstddef>
#include <string>

#include "waymark/cli/detect_all.hpp"

namespace waymark::cli {

/// Finds the tags in every picture of a recording, as detect_all() does for files. Pictures are named
/// FILE#SECONDS after their stamp.
void detect_recording(std::size_t index, const std::string& path, const TagFinder& finder, Console& console,
                      const EachPicture& each, DetectSummary& summary);

}  // namespace waymark::cli
