#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "waymark/families/family.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/detector/quads.hpp"

namespace waymark::search {

struct NearestCode {
  int number = 0;
  int distance = 0;
};

/// Finds the code of a family that differs in only a few bits, without a list of all wrong codes. If the code
/// is cut into one piece more than the number of wrong bits, at least one piece is correct (Norouzi, Punjani
/// and Fleet, "Fast search in Hamming space with multi-index hashing", CVPR 2012). Needs a few words of
/// memory per code.
class CodeIndex {
 public:
  /// `max_distance` must be from 0 to 3.
  CodeIndex(const Family& family, int max_distance);

  /// The nearest code within max_distance; if several are equally near, the one with the lowest number.
  [[nodiscard]] std::optional<NearestCode> find(std::uint64_t code) const;

  /// The code that agrees with `code` in all bits set in `known`; `nullopt` if there is none or more than
  /// one. O(codes).
  [[nodiscard]] std::optional<int> find_exact(std::uint64_t code, std::uint64_t known) const;

 private:
  /// The numbers of the codes, grouped by the value of one piece of their bits.
  struct Piece {
    unsigned shift = 0;
    std::uint64_t mask = 0;
    std::vector<std::uint32_t> begins;  ///< indices into numbers; one more than there are values
    std::vector<std::uint32_t> numbers;
  };

  std::vector<std::uint64_t> codes_;
  std::vector<Piece> pieces_;
  int max_distance_ = 0;
};

/// The homography from cells (the border square is [0, width]^2) to the quad. Returns false if it does not
/// exist.
[[nodiscard]] bool homography(const Quad& quad, int width, Eigen::Matrix3f& px_H_cell);

/// Levels of an image at positions specified in cells of a quad.
class CellView {
 public:
  /// `sign` is -1 if the border is bright: levels are then negative, so that the border is low again.
  CellView(const ImageView& image, const Eigen::Matrix3f& px_H_cell, float sign)
      : image_(&image), px_H_cell_(px_H_cell), sign_(sign) {}

  /// A pixel in homogeneous coordinates (x, y, w).
  [[nodiscard]] Eigen::Vector3f place(float u, float v) const {
    return px_H_cell_.col(0) * u + px_H_cell_.col(1) * v + px_H_cell_.col(2);
  }

  /// Interpolated bilinearly and multiplied by the sign; outside the image, the nearest pixel is used.
  [[nodiscard]] float level(const Eigen::Vector3f& place) const {
    const ImageView& image = *image_;
    const float w = 1 / place.z();
    const float x = std::clamp(place.x() * w - 0.5F, 0.0F, static_cast<float>(image.width - 1));
    const float y = std::clamp(place.y() * w - 0.5F, 0.0F, static_cast<float>(image.height - 1));
    const int x0 = static_cast<int>(x);
    const int y0 = static_cast<int>(y);
    const int right = x0 + 1 < image.width ? 1 : 0;
    const std::uint8_t* top = image.data + static_cast<std::ptrdiff_t>(y0) * image.stride + x0;
    const std::uint8_t* bottom = y0 + 1 < image.height ? top + image.stride : top;
    const float du = x - static_cast<float>(x0);
    const float dv = y - static_cast<float>(y0);
    const float above = static_cast<float>(top[0]) + du * static_cast<float>(top[right] - top[0]);
    const float below = static_cast<float>(bottom[0]) + du * static_cast<float>(bottom[right] - bottom[0]);
    return sign_ * (above + dv * (below - above));
  }

  [[nodiscard]] float level(float u, float v) const { return level(place(u, v)); }
  /// The direction of one cell along u (axis 0) or v (axis 1).
  [[nodiscard]] Eigen::Vector3f step(int axis) const { return px_H_cell_.col(axis); }

 private:
  const ImageView* image_;
  Eigen::Matrix3f px_H_cell_;
  float sign_;
};

/// The levels of a tag's cells, row by row, including `margin` cells around its border.
struct CellLevels {
  std::span<const float> levels;
  int width = 0;   ///< side of the border square, in cells
  int margin = 1;  ///< in cells

  [[nodiscard]] float at(int x, int y) const {
    const int index = (y + margin) * (width + 2 * margin) + x + margin;
    return levels[static_cast<std::size_t>(index)];
  }
};

/// Illumination that changes at a straight line across a tag, for example at the edge of a shadow.
struct ShadowEdge {
  Eigen::Vector2f normal{0, 0};   ///< towards the illuminated side
  float offset = 0;               ///< [cell] the line consists of the places with normal . place = offset
  std::array<float, 2> border{};  ///< level of black inside and outside the shadow
  std::array<float, 2> around{};  ///< level of white inside and outside the shadow

  /// The illuminated fraction of a cell.
  [[nodiscard]] float lit(int x, int y) const;
  /// The level that a cell would have if there were no shadow.
  [[nodiscard]] float level_if_lit(float level, int x, int y) const;
};

/// The edge between the two arcs that best separate the cells around the border. Empty unless the arcs
/// explain most of the variation and black differs from white on both sides. O(width^2).
[[nodiscard]] std::optional<ShadowEdge> find_shadow_edge(const CellLevels& cells, float min_contrast);

/// Evidence for a code against random bits, measured in bits: the base-2 logarithm of the likelihood ratio of
/// the cell levels. A level far from the threshold contributes up to 0.96 bits, a level at the threshold
/// contributes nothing, and a level far on the wrong side costs 4 bits. For random bits the expected ratio is
/// one, so t bits are reached with a probability of at most 2^-t (Markov's inequality). `distances` holds the
/// distances of all sampled cells from the threshold, and `cells` the indices of those that are bits, most
/// significant bit first. `wrong_bits` has ones where the code differs from the observed bits. O(cells).
[[nodiscard]] float evidence_bits(std::span<const float> distances, std::span<const std::uint16_t> cells,
                                  std::uint64_t wrong_bits);

/// A family prepared for reading, with its cells in the order that applies after each quarter turn.
struct ReadableFamily {
  FamilyId id = FamilyId::Tag36h11;
  int width = 0;   ///< side of the border square, in cells
  int margin = 1;  ///< number of cells sampled around the border, including any data bits there
  bool bright_border = false;
  /// For each quarter turn of the print, the sampled cell of each bit, most significant bit first. Cells are
  /// numbered row by row, starting at the first corner of the quad.
  std::array<std::vector<std::uint16_t>, 4> cells;
  CodeIndex codes;
  /// Numbers of the tags that a map predicts here. They are read with up to four wrong bits if the cell
  /// levels provide sufficient evidence (evidence_bits()).
  std::vector<int> known{};

  ReadableFamily(const Family& family, int max_hamming);
};

/// Number of sampled cells along each side.
[[nodiscard]] inline int side_of(const ReadableFamily& family) { return family.width + 2 * family.margin; }

struct ReaderOptions {
  double min_contrast = 5;  ///< [grey level] difference between the border and its surroundings
  double min_margin = 0;    ///< [grey level] see TagDetection::decision_margin
};

/// Minimum number of changes between cells inside the border: the bits of a tag change often, whereas the
/// contents of most other quads change rarely.
inline constexpr int kMinChanges = 8;

/// How far the reading of a quad got, whether successful or not.
struct ReadProgress {
  bool border_seen = false;  ///< the border was detected, so the bits were read
  int sides_seen = 0;        ///< number of sides along which most cells have the contrast of a border
  int changes = 0;           ///< number of changes between dark and bright in neighbouring cells inside
};

/// Reads tags in quads. The levels of black and white are planes fitted to the border and its surroundings,
/// so the illumination may vary across the tag. Bits are compared with the mean of the two planes, after
/// several amounts of sharpening.
class TagReader {
 public:
  explicit TagReader(const ReaderOptions& options) : options_(options) {}

  /// The number of eight positions on the quad's edges, two per side, at which the level steps outwards. Its
  /// cost is low.
  [[nodiscard]] int steps_outwards(const ImageView& image, const Quad& quad, const ReadableFamily& family,
                                   bool inverted);

  /// The tag of this family whose border is the quad, with the quad's corners as its corners. `inverted`
  /// specifies a print with black and white exchanged. O(cells).
  std::optional<TagDetection> read(const ImageView& image, const Quad& quad, const ReadableFamily& family,
                                   bool inverted, ReadProgress& progress);

  /// The same for a tag whose white is beyond the range of the image. Its black cells are brightened by their
  /// neighbours, so the threshold is near the brighter level. All bits must be correct.
  std::optional<TagDetection> read_overexposed(const ImageView& image, const Quad& quad,
                                               const ReadableFamily& family, bool inverted);

  /// The same for a tag whose side after corner `covered` of the quad is occluded. The levels are computed
  /// from the other three sides, which must be visible, and are assumed to be constant.
  std::optional<TagDetection> read_covered(const ImageView& image, const Quad& quad,
                                           const ReadableFamily& family, bool inverted, std::size_t covered);

 private:
  /// Levels across the tag: the value at its centre, and the change per cell along x and along y.
  using Plane = std::array<float, 3>;
  struct Levels {
    Plane border{};
    Plane around{};
    [[nodiscard]] float contrast() const { return around[0] - border[0]; }
  };

  /// Of eight pairs of cells, two on each side, the number that have the contrast of a border.
  [[nodiscard]] int steps_outwards(const ImageView& image, const ReadableFamily& family) const;
  bool place(const Quad& quad, const ReadableFamily& family, bool inverted);
  /// The levels of a quad that has the border of this family, after sampling all cells.
  std::optional<Levels> see_border(const ImageView& image, const Quad& quad, const ReadableFamily& family,
                                   bool inverted, ReadProgress& progress);
  Levels sample_border(const ImageView& image, const ReadableFamily& family);
  /// For each side, starting at the first corner of the quad, the number of its cells that differ from those
  /// outside.
  [[nodiscard]] std::array<int, 4> border_pairs(const ReadableFamily& family, float step) const;
  [[nodiscard]] Levels levels_beside(const ReadableFamily& family, std::size_t covered) const;
  [[nodiscard]] int changes_inside(const ReadableFamily& family) const;
  void sample_inside(const ImageView& image, const ReadableFamily& family);
  void sharpen(const ReadableFamily& family, const Levels& levels, float amount, float share = 0.5F);
  std::optional<TagDetection> decode(const Quad& quad, const ReadableFamily& family);
  /// The known tag for which the levels provide the most evidence; empty if even that is insufficient.
  std::optional<TagDetection> decode_known(const Quad& quad, const ReadableFamily& family,
                                           const Levels& levels);
  /// Decodes the tag after making the cell levels on the two sides of a shadow's edge equal; empty if there
  /// is no shadow.
  std::optional<TagDetection> decode_in_shadow(const Quad& quad, const ReadableFamily& family);
  /// Decodes the tag without the bits next to a covered side; all other bits must be correct.
  std::optional<TagDetection> decode_beside(const Quad& quad, const ReadableFamily& family,
                                            std::size_t covered);
  [[nodiscard]] std::uint64_t code_of(const ReadableFamily& family, std::size_t turn) const;
  [[nodiscard]] bool all_nearly_undecided(const ReadableFamily& family, std::size_t turn,
                                          std::uint64_t wrong_bits, std::uint64_t known_bits,
                                          float& margin) const;
  [[nodiscard]] float sample(const ImageView& image, float u, float v) const;
  [[nodiscard]] float& cell(const ReadableFamily& family, int x, int y);

  ReaderOptions options_;
  float sign_ = 1;  ///< -1 if the border is bright: levels are then negative, so that the border is low again
  Eigen::Matrix3f px_H_cell_ = Eigen::Matrix3f::Identity();
  std::vector<float> levels_;     ///< levels of the sampled cells
  std::vector<float> distances_;  ///< distances of the sharpened cells from the threshold
};

}  // namespace waymark::search
