#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "waymark/families/family.hpp"
#include "waymark/image/image.hpp"
#include "waymark/tags/pattern_sums.hpp"
#include "waymark/tags/straightening.hpp"

namespace waymark::refinement {

inline constexpr int kMaxCells = 16;  ///< cells along the border square; AprilTag's families have 3 to 10

/// The cells of a printed tag by rows and columns from -kRing to cells + kRing - 1, each as its share (0 or
/// 1) of white. What lies beyond the white margin counts as white, and is known to be unknown.
struct Pattern {
  static constexpr int kRing = 4;
  static constexpr int kSide = kMaxCells + 2 * kRing;
  int cells = 0;  ///< along the border square
  int ring = 1;   ///< cells outside the border square that are printed with the tag
  std::array<std::array<float, kSide>, kSide> white{};
  std::array<std::array<bool, kSide>, kSide> known{};

  [[nodiscard]] float white_at(int x, int y) const { return white[index(y)][index(x)]; }
  [[nodiscard]] bool known_at(int x, int y) const { return known[index(y)][index(x)]; }
  [[nodiscard]] static std::size_t index(int cell) { return static_cast<std::size_t>(cell + kRing); }
};

/// The pattern of a tag. Requires an id that exists in the family. O(cells).
[[nodiscard]] Pattern tag_pattern(const TagId& id);

/// The pixels of one cell of a tag.
struct Patch {
  int first_row = 0;  ///< in TagPixels
  int rows = 0;
  PatchWindow window;
  int side = -1;               ///< the border (0 top, 1 right, 2 bottom, 3 left) outside which it lies, or -1
  double x = 0, y = 0;         ///< mean of its pixels
  Eigen::Vector2d bend{0, 0};  ///< how kLens moves it, in x and y
  double weight = 1;           ///< 0 to 1: how much it counts
};

/// Which pixels to read.
struct PixelLimits {
  double outside_cells = 1;  ///< how far outside the border square
  double blur_cells = 0.2;   ///< greatest standard deviation of the blur, tells how many cells matter
  Straightening straightening;
  int most_pixels = 1500;  ///< of larger tags only so many, evenly spread
};

/// The pixels of a tag, by patches. x and y are relative to `middle_px`, in units of `unit_px`.
struct TagPixels {
  static constexpr int kMostRows = 900;
  static constexpr int kMostPatches = 196;
  Eigen::Vector2d middle_px{0, 0};
  double unit_px = 1;
  bool clipped = false;
  int patches = 0;
  int pixels = 0;
  std::array<Patch, kMostPatches> patch;
  std::array<float, kMostRows * kLanes> x, y, value, weight;

  [[nodiscard]] PatchRows rows(const Patch& of) const;
};

/// Reads the pixels around a tag whose homography is known about: x_H_tag takes the border square, from -1 to
/// 1 in both directions, to x and y. `middle_px` and `unit_px` of `pixels` must be set. False when too few
/// are in the image.
[[nodiscard]] bool read_pixels(const ImageView& image, const Pattern& pattern, const Eigen::Matrix3d& x_H_tag,
                               const PixelLimits& limits, TagPixels& pixels);

}  // namespace waymark::refinement
