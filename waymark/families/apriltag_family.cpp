#include "waymark/families/apriltag_family.hpp"

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

#include <array>
#include <cstddef>

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

}  // namespace waymark
