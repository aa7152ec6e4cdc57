#include "waymark/families/apriltag_family.hpp"

#include <array>
#include <cstddef>

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>

namespace waymark {
namespace {

struct Maker {
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

/// In the order of FamilyId.
constexpr std::array<Maker, kAllFamilies.size()> kMakers = {{
    {tag16h5_create, tag16h5_destroy},
    {tag25h9_create, tag25h9_destroy},
    {tag36h10_create, tag36h10_destroy},
    {tag36h11_create, tag36h11_destroy},
    {tagCircle21h7_create, tagCircle21h7_destroy},
    {tagCircle49h12_create, tagCircle49h12_destroy},
    {tagCustom48h12_create, tagCustom48h12_destroy},
    {tagStandard41h12_create, tagStandard41h12_destroy},
    {tagStandard52h13_create, tagStandard52h13_destroy},
}};

}  // namespace

AprilTagFamily make_apriltag_family(FamilyId id) {
  const Maker& maker = kMakers.at(static_cast<std::size_t>(id));
  return {maker.create(), maker.destroy};
}

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
