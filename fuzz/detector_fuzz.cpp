// Any pixels, size and stride give finite detections of existing tags, identical for all kernels of the
// processor; the libapriltag detector returns a result as well.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "waymark/tags/apriltag3/apriltag_detector.hpp"
#include "waymark/tags/detector/tag_search.hpp"

namespace {

using namespace waymark;

std::vector<search::ReadableFamily> all_families() {
  std::vector<search::ReadableFamily> families;
  for (const FamilyId id :
       {FamilyId::Tag16h5, FamilyId::Tag36h11, FamilyId::TagCircle21h7, FamilyId::TagStandard41h12})
    families.emplace_back(family(id), 1);
  return families;
}

bool good(const TagDetection& tag) {
  const bool finite =
      std::ranges::all_of(tag.corners_px, [](const auto& corner) { return corner.allFinite(); });
  return finite && tag.tag.number >= 0 &&
         tag.tag.number < static_cast<int>(family(tag.tag.family).codes.size()) && tag.decision_margin >= 0;
}

}  // namespace

extern "C" std::size_t LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<search::ReadableFamily> families = all_families();
  static search::TagSearch best({.find_inverted = true});
  static search::TagSearch portable({.find_inverted = true}, search::portable_plane_kernels());
  static const auto library = make_apriltag_detector().value();
  constexpr std::size_t kHeader = 2;
  if (size <= kHeader) return 0;
  const int width = 1 + data[0];
  const int stride = width + data[1] % 9;
  const auto pixels = static_cast<int>(size - kHeader);
  // The last row may end before its stride.
  const int height = (pixels + stride - width) / stride;
  if (height < 1) return 0;
  const std::vector<std::uint8_t> copy(data + kHeader, data + size);
  const ImageView image{copy.data(), width, height, stride};
  const std::vector<TagDetection>& found = best.run(image, families);
  if (!std::ranges::all_of(found, good)) std::abort();
  const std::vector<TagDetection>& again = portable.run(image, families);
  const bool same = std::ranges::equal(found, again, [](const TagDetection& a, const TagDetection& b) {
    return a.tag == b.tag && a.hamming == b.hamming && a.corners_px == b.corners_px;
  });
  if (!same || !library->detect(image)) std::abort();
  return 0;
}
