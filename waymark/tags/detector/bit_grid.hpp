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

/// A side of a quad that does not coincide with the tag's border.
struct MisplacedSide {
  Quad quad{};           ///< the quad with this side made parallel to the opposite one
  std::size_t side = 0;  ///< index of the corner before this side
  float missing = 0;     ///< [cell] distance to the border's side; negative if outside the border
  float fit = 0;         ///< how well the changes inside coincide with cell boundaries
};

/// The sides that would fit clearly better elsewhere, best first. If a whole cell is missing, there are two
/// or more, because the cell may be missing at either end.
struct MisplacedSides {
  std::array<MisplacedSide, 4> sides{};
  std::size_t count = 0;
};

/// Estimates the sides of a quad from the changes in level between the cells inside it.
class BitGrid {
 public:
  /// For each side, finds the displacement at which the changes inside coincide with cell boundaries. Reads
  /// only the inside of the quad, in steps of a quarter of a cell.
  [[nodiscard]] MisplacedSides misplaced_sides(const ImageView& image, const Quad& quad,
                                               const ReadableFamily& family, bool inverted);

  /// Moves the corners of a decoded tag so that the steps between its cells coincide with cell boundaries.
  /// The sides of the border are used as well if they agree with the bits, so that an occluded side does not
  /// move a corner. Corners that agree with the bits are left unchanged. Returns false if the steps do not
  /// lie near the cell boundaries of any quad.
  [[nodiscard]] bool align_corners(const ImageView& image, const ReadableFamily& family, bool inverted,
                                   TagDetection& tag);

  /// The same for a tag whose white is beyond the range of the image and therefore spreads over the rims of
  /// the black cells. The spread is estimated from the steps, so that the corners are those of the print and
  /// not of its visible border. Returns false, and leaves the tag unchanged, if white spreads by less than
  /// half a pixel or the steps do not lie near the cell boundaries of any quad.
  [[nodiscard]] bool align_overexposed(const ImageView& image, const ReadableFamily& family, bool inverted,
                                       TagDetection& tag);

 private:
  /// Position of a step between two cells, measured along one direction.
  struct Step {
    float u = 0, v = 0;  ///< [cell] expected position
    int axis = 0;        ///< axis along which the step is searched for
    float offset = 0;    ///< [cell] from the expected position
    float weight = 0;
    bool outer = false;  ///< whether the step is on a side of the border
    bool rises = false;  ///< whether the far side of the step is the brighter one
  };

  void color(const ReadableFamily& family, int number);
  void measure(const ImageView& image, const Quad& quad, const ReadableFamily& family, float sign);
  bool correct(const ReadableFamily& family, bool with_border, Quad& quad) const;
  bool correct_with_spread(const ReadableFamily& family, float& spread, Quad& quad) const;

  std::vector<std::uint8_t> high_;  ///< one per cell of a print, row by row: 1 or 0; 2 if undetermined
  std::vector<Step> steps_;
  std::vector<float> profile_;
};

/// The quad with a side moved outwards by this many cells, in the plane of the tag.
[[nodiscard]] Quad with_side_moved(const Quad& quad, std::size_t side, float by_cells, int width);

}  // namespace waymark::search
