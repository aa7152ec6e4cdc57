#include "tests/sheets/tag_finder.hpp"

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

#include <algorithm>

namespace waymark::testing {
namespace {

struct Maker {
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

/// In the order of FamilyId.
constexpr std::array<Maker, 9> kMakers = {{{tag16h5_create, tag16h5_destroy},
                                           {tag25h9_create, tag25h9_destroy},
                                           {tag36h10_create, tag36h10_destroy},
                                           {tag36h11_create, tag36h11_destroy},
                                           {tagCircle21h7_create, tagCircle21h7_destroy},
                                           {tagCircle49h12_create, tagCircle49h12_destroy},
                                           {tagCustom48h12_create, tagCustom48h12_destroy},
                                           {tagStandard41h12_create, tagStandard41h12_destroy},
                                           {tagStandard52h13_create, tagStandard52h13_destroy}}};

}  // namespace

std::vector<SeenTag> find_tags(const Raster& page, FamilyId id) {
  const Maker& maker = kMakers.at(static_cast<std::size_t>(id));
  apriltag_family_t* raw = maker.create();
  apriltag_detector_t* detector = apriltag_detector_create();
  apriltag_detector_add_family_bits(detector, raw, 0);
  detector->quad_decimate = 1.0F;
  std::vector<std::uint8_t> pixels = page.grey;
  image_u8_t image = {.width = page.width, .height = page.height, .stride = page.width, .buf = pixels.data()};
  zarray_t* found = apriltag_detector_detect(detector, &image);
  std::vector<SeenTag> tags;
  for (int i = 0; i < zarray_size(found); ++i) {
    apriltag_detection_t* one = nullptr;
    zarray_get(found, i, &one);
    SeenTag seen{{id, one->id}, {}};
    for (std::size_t corner = 0; corner < 4; ++corner) {
      const double* p = one->p[3 - corner];
      seen.corners_mm.at(corner) = {p[0] / page.px_per_mm(), p[1] / page.px_per_mm()};
    }
    tags.push_back(seen);
  }
  apriltag_detections_destroy(found);
  apriltag_detector_destroy(detector);
  maker.destroy(raw);
  std::sort(tags.begin(), tags.end(), [](const SeenTag& a, const SeenTag& b) { return a.tag < b.tag; });
  return tags;
}

}  // namespace waymark::testing
