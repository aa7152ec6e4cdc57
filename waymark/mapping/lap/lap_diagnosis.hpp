#pragma once

#include <string>
#include <vector>

#include "waymark/mapping/lap/bundle_map.hpp"

/// The parts of check_map() that look at the lap as a whole.
namespace waymark::internal {

/// A part of the picture where corners are off all in one direction: the lens is not the one it is taken for.
void check_regions(const BundleMap& map, std::vector<std::string>& words);
/// Tags on one line: what lies across it is known badly.
void check_line(const BundleMap& map, std::vector<std::string>& words);
/// Times when no tag was seen.
void check_blindness(const LapInput& lap, const BundleMap& map, std::vector<std::string>& words);
/// A camera that sits elsewhere than assumed.
void check_mounting(const BundleMap& map, std::vector<std::string>& words);

}  // namespace waymark::internal
