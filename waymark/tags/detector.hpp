#pragma once

#include <memory>
#include <span>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {

/// A rectangle of pixels: [x, x + width) x [y, y + height).
struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;
};

/// Finds tags in a grey image. Implementations are exchangeable; every one returns corners in full-image
/// pixels, finite, sorted by tag id and then by position, so that the same image gives the same answer.
class Detector {
 public:
  virtual ~Detector() = default;
  Detector(const Detector&) = delete;
  Detector& operator=(const Detector&) = delete;

  /// All tags in the image. An image too small to hold one gives an empty list; one larger than the
  /// implementation can address gives LimitExceeded. Safe to call from several threads.
  [[nodiscard]] virtual Result<std::vector<TagDetection>> detect(const ImageView& image) const = 0;

  /// The tags whose centre lies in one of some rectangles of the image (clipped to it). A little more of the
  /// image than the rectangle is looked at, so that a tag needs no room for its white margin in it. A tag
  /// found in two of them is reported once, as its better reading. Costs about the sum of the areas:
  /// overlapping rectangles are not merged.
  [[nodiscard]] virtual Result<std::vector<TagDetection>> detect(const ImageView& image,
                                                                 std::span<const PixelRect> regions) const;

 protected:
  Detector() = default;

 private:
  /// [px] Cutting the image at multiples of this changes nothing in how its pixels are grouped.
  [[nodiscard]] virtual int region_alignment_px() const { return 1; }
};

/// Sorts by tag id, then by the position of the first corner (x, then y), then by decision margin, largest
/// first.
void sort_detections(std::vector<TagDetection>& detections);

/// Of detections of the same tag that overlap in the image, keeps the best reading: fewest bits corrected,
/// then largest decision margin, then lowest position. Readings apart from each other are different prints of
/// one tag and stay. The result is sorted as by sort_detections. O(n log n + pairs of the same tag).
void remove_duplicates(std::vector<TagDetection>& detections);

}  // namespace waymark
