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

/// Finds tags in a grey image. Implementations are exchangeable; every one returns corners in full-image pixels, sorted by
/// tag id and then by position, so that the same image gives the same answer.
class Detector {
 public:
  virtual ~Detector() = default;
  Detector(const Detector&) = delete;
  Detector& operator=(const Detector&) = delete;

  /// All tags in the image. An image too small to hold one gives an empty list. Safe to call from several threads.
  [[nodiscard]] virtual Result<std::vector<TagDetection>> detect(const ImageView& image) const = 0;

  /// The tags in some rectangles of the image only (clipped to it); a tag found in two of them is reported once.
  [[nodiscard]] Result<std::vector<TagDetection>> detect(const ImageView& image, std::span<const PixelRect> regions) const;

 protected:
  Detector() = default;
};

}  // namespace waymark
