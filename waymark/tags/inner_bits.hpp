#pragma once

#include <array>
#include <cstddef>

#include "waymark/families/family.hpp"
#include "waymark/image/image.hpp"
#include "waymark/tags/lanes.hpp"
#include "waymark/tags/tag_bands.hpp"
#include "waymark/tags/tag_fit.hpp"

namespace waymark::refinement {

/// Pixels inside the border of a tag and the cells around them, kLanes side by side.
struct InnerPixels {
  static constexpr int kFew = 200;   ///< enough to correct edges that the border has placed
  static constexpr int kMany = 800;  ///< to place them without the border
  static constexpr int kMostBlocks = 2 * kMany / kLanes;

  struct Block {
    Lanes value;   ///< grey level in even light
    Lanes weight;  ///< 0 or 1
    Lanes s, t;    ///< place along TL-TR and along TR-BR, -1 to 1 inside the border
    std::array<std::array<Lanes, 3>, 2>
        past_px;                       ///< how far past the three nearest lines between columns, rows
    std::array<Lanes, 2> px_per_cell;  ///< across columns, rows
    std::array<std::array<Lanes, 3>, 2> place;  ///< where those lines lie, -1 to 1
    std::array<std::array<Lanes, 4>, 4> white;  ///< rows by columns: share of white of the cells around them
  };
  std::array<Block, kMostBlocks> block;
  int count = 0;  ///< pixels

  [[nodiscard]] std::size_t blocks() const { return static_cast<std::size_t>((count + kLanes - 1) / kLanes); }
};

/// Reads them where the four border edges of `estimate` say that the cells lie; of large tags `most` (kFew or
/// kMany) that are spread evenly. O(pixels).
void read_inner_pixels(const ImageView& image, const TagId& id, const TagBands& tag,
                       const TagEstimate& estimate, int most, InnerPixels& pixels);

}  // namespace waymark::refinement
