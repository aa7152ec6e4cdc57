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

/// A side of a quad that does not coincide with the border of the tag.
struct MisplacedSide {
  Quad quad{};           ///< with this side made parallel to the opposite one
  std::size_t side = 0;  ///< after this corner
  float missing = 0;     ///< [cell] distance from it to the border's side; negative: it lies outside
  float fit = 0;         ///< how well the changes inside coincide with cell boundaries
};

/// The sides that fit clearly better elsewhere, best first. If a whole cell is missing there are two or more,
/// because it may be missing at either end.
struct MisplacedSides {
  std::array<MisplacedSide, 4> sides{};
  std::size_t count = 0;
};

/// Estimates the sides of a quad from the changes between the cells inside it.
class BitGrid {
 public:
  /// For each side, the displacement after which the changes inside coincide with cell boundaries. Reads only
  /// the inside of the quad, in steps of a quarter of a cell.
  [[nodiscard]] MisplacedSides misplaced_sides(const ImageView& image, const Quad& quad,
                                               const ReadableFamily& family, bool inverted);

  /// Moves the corners of a decoded tag so that the steps between its cells are at cell boundaries. The
  /// border's own sides are used if they agree with the bits, so an occlusion of a side moves no corner.
  /// Corners that agree with the bits are unchanged. Returns false if the steps are not near those of any
  /// quad.
  [[nodiscard]] bool align_corners(const ImageView& image, const ReadableFamily& family, bool inverted,
                                   TagDetection& tag);

 private:
  /// Position of a step between two cells along one direction.
  struct Step {
    float u = 0, v = 0;  ///< [cell] expected position
    int axis = 0;        ///< axis of the search
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

/// The quad with a side moved outwards by this many cells, in the plane of the tag.
[[nodiscard]] Quad with_side_moved(const Quad& quad, std::size_t side, float by_cells, int width);

}  // namespace waymark::search
