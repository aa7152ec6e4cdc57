#pragma once

#include <cstdint>
#include <string>

namespace waymark::photo {

/// What lies behind the tags: a smooth function of the picture, from -1 to 1.
struct Backdrop {
  enum class Kind : std::uint8_t { Flat, Gradient, Clutter };

  Kind kind = Kind::Flat;
  double size_px = 48;     ///< of the largest blobs of clutter
  std::uint64_t seed = 0;  ///< of clutter
  int width_px = 1;
  int height_px = 1;

  /// Flat: 0. Gradient: from -1 in the top left to 1 in the bottom right corner. Clutter: value noise of
  /// several octaves, each half the size of the one before, down to 4 px (Lewis, "Algorithms for solid noise
  /// synthesis", SIGGRAPH 1989; value noise on a lattice, cubic blending). O(octaves).
  [[nodiscard]] double at(double x, double y) const;
};

}  // namespace waymark::photo
