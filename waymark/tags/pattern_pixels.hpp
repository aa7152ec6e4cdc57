#pragma once

#include <array>
#include <cstddef>
#include <span>

#include <Eigen/Core>

#include "waymark/image/image.hpp"
#include "waymark/tags/pattern_sums.hpp"
#include "waymark/tags/pixel_search.hpp"

namespace waymark::refinement {

/// The pixels of a tag. x and y are relative to `middle_px`, in units of `unit_px`. Pixels of one cell are
/// next to each other: in slots by clusters (pattern_sums.hpp), clusters of one side of the tag together.
struct TagPixels {
  static constexpr int kMostBlocks = 32;
  static_assert(kMostPixels + 6 * kClusterPixels <= kMostBlocks * kBlockPixels);
  Eigen::Vector2d middle_px{0, 0};
  double unit_px = 1;
  std::size_t steps = 2;
  int blocks = 0;
  int pixels = 0;
  bool clipped = false;
  double black = 0, white = 0;  ///< [grey level] means of the pixels of black and of white cells
  std::array<PixelBlock, kMostBlocks> block;

  [[nodiscard]] PatternRows rows() const {
    return {.blocks = blocks, .clipped = clipped, .steps = steps, .block = block.data()};
  }
  [[nodiscard]] std::span<PixelBlock> used() { return {block.data(), static_cast<std::size_t>(blocks)}; }
  [[nodiscard]] std::span<const PixelBlock> used() const {
    return {block.data(), static_cast<std::size_t>(blocks)};
  }
};

/// Reads the pixels around a tag whose homography is known about: x_H_tag takes the border square, from -1 to
/// 1 in both directions, to x and y. `middle_px` and `unit_px` of `pixels` must be set. False when too few
/// are in the image. O(pixels).
[[nodiscard]] bool read_pixels(const ImageView& image, const Pattern& pattern,
                               const Straightening& straightening, const Eigen::Matrix3d& x_H_tag,
                               const PixelLimits& limits, TagPixels& pixels);

}  // namespace waymark::refinement
