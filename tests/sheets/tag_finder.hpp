#pragma once

#include <array>
#include <vector>

#include "tests/support/raster.hpp"
#include "waymark/families/family.hpp"
#include "waymark/plot/drawing.hpp"

namespace waymark::testing {

/// A tag as AprilTag 3 sees it on a page: corners TL, TR, BR, BL of the printed tag, in mm.
struct SeenTag {
  TagId tag;
  std::array<plot::Point, 4> corners_mm;
};

/// Asks libapriltag itself, without bit correction. Sorted by number.
std::vector<SeenTag> find_tags(const Raster& page, FamilyId family);

}  // namespace waymark::testing
