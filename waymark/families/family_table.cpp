#include "waymark/families/family_table.hpp"

#include <apriltag/apriltag.h>

#include <cstddef>

#include "waymark/families/apriltag_family.hpp"

namespace waymark {

Family load_family(FamilyId id) {
  const AprilTagFamily raw = make_apriltag_family(id);
  Family family;
  family.id = id;
  family.name = to_string(id);
  family.width_at_border = raw->width_at_border;
  family.total_width = raw->total_width;
  family.reversed_border = raw->reversed_border;
  family.min_hamming = static_cast<int>(raw->h);
  family.bits.reserve(raw->nbits);
  for (std::size_t i = 0; i < raw->nbits; ++i) {
    // The library stores signed cells in unsigned words: -2 lies two cells outside the border.
    family.bits.push_back(
        {static_cast<std::int32_t>(raw->bit_x[i]), static_cast<std::int32_t>(raw->bit_y[i])});
  }
  family.codes.assign(raw->codes, raw->codes + raw->ncodes);
  return family;
}

}  // namespace waymark
