#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/detector/quads.hpp"
#include "waymark/tags/detector/tag_reader.hpp"

namespace waymark::search {

/// One side of a quad that is not where the border of the tag has it.
struct MisplacedSide {
  Quad quad{};           ///< with this side made parallel to the one opposite
  std::size_t side = 0;  ///< after this corner
  float missing = 0;     ///< [cell] what lies between it and the border's side; negative: it lies outside
  float fit = 0;         ///< how well the changes inside lie where cells end
};

/// The sides that fit clearly better elsewhere, best first. Two or more where a whole cell is missing, which
/// may be at either end.
struct MisplacedSides {
  std::array<MisplacedSide, 4> sides{};
  std::size_t count = 0;
};

/// Where the changes between the cells inside a quad say that its sides are.
class BitGrid {
 public:
  /// For each side, how far it would have to move so that the changes inside lie where cells end. Looks at
  /// the inside only, in steps of a quarter of a cell.
  [[nodiscard]] MisplacedSides misplaced_sides(const ImageView& image, const Quad& quad,
                                               const ReadableFamily& family, bool inverted);

  /// Moves the corners of a tag that was read so that the steps between its cells lie where they should. The
  /// border's own sides count where they agree with the bits: what covers one moves no corner. Does nothing
  /// where the bits agree with the corners as they are. False where the steps are near no place that a quad
  /// has.
  [[nodiscard]] bool settle(const ImageView& image, const ReadableFamily& family, bool inverted,
                            TagDetection& tag);

 private:
  /// Where a step between two cells is along one direction.
  struct Step {
    float u = 0, v = 0;  ///< [cell] where it should be
    int axis = 0;        ///< across which it was searched
    float offset = 0;    ///< [cell]
    float weight = 0;
    bool outer = false;  ///< a side of the border
  };

  void color(const ReadableFamily& family, int number);
  void measure(const ImageView& image, const Quad& quad, const ReadableFamily& family, float sign);
  bool correct(const ReadableFamily& family, bool with_border, Quad& quad) const;

  std::vector<std::uint8_t> high_;  ///< of the cells of a print, row by row
  std::vector<Step> steps_;
  std::vector<float> profile_;
};

/// The quad with a side moved so many cells outwards, in the plane of the tag.
[[nodiscard]] Quad with_side_moved(const Quad& quad, std::size_t side, float by_cells, int width);

}  // namespace waymark::search
