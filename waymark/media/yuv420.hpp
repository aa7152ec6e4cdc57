#pragma once

#include <cstddef>
#include <cstdint>

#include "waymark/image/image.hpp"

/// Pictures as encoders take them: a plane of luma, and two of chroma with half its width and height; full
/// range.
namespace waymark::internal {

struct Yuv420 {
  std::uint8_t* y = nullptr;
  std::uint8_t* cb = nullptr;
  std::uint8_t* cr = nullptr;
  std::ptrdiff_t y_stride = 0, cb_stride = 0, cr_stride = 0;
  int width = 0, height = 0;  ///< even; what the picture lacks repeats its last column and row
};

void fill(const ImageView& image, const Yuv420& to);
/// Rec. 601; chroma is the mean of four pixels.
void fill(const ColorImage& image, const Yuv420& to);

}  // namespace waymark::internal
