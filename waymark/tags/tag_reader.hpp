#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "waymark/families/family.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/code_index.hpp"
#include "waymark/tags/quads.hpp"

namespace waymark::search {

/// A family as it is read: which cells, in which order after each quarter turn.
struct ReadableFamily {
  FamilyId id = FamilyId::Tag36h11;
  int width = 0;   ///< [cell] of the border square
  int margin = 1;  ///< [cell] sampled around it: the surroundings of the border, and data bits there
  bool bright_border = false;
  /// For each quarter turn of the print, the sampled cell (row by row from the quad's first corner) of each
  /// bit, most significant first.
  std::array<std::vector<std::uint16_t>, 4> cells;
  CodeIndex codes;
  /// Numbers that a map says may be here: these are read with up to four wrong bits where the levels of the
  /// cells are evidence enough (soft_bits.hpp).
  std::vector<int> known{};

  ReadableFamily(const Family& family, int max_hamming);
};

/// Sampled cells along a side.
[[nodiscard]] inline int side_of(const ReadableFamily& family) { return family.width + 2 * family.margin; }

struct ReaderOptions {
  double min_contrast = 5;  ///< [grey level] between the border and its surroundings
  double min_margin = 0;    ///< [grey level] see TagDetection::decision_margin
};

/// Changes between cells inside: the bits of a tag change often, the inside of most other quads hardly.
inline constexpr int kFewChanges = 8;

/// What was seen of a quad that was read, or could not be.
struct ReadProgress {
  bool border_seen = false;  ///< so that bits were read
  int sides_seen = 0;        ///< of the border: those along which most cells differ as a border's do
  int changes = 0;           ///< between dark and bright among neighbouring cells inside
};

/// Reads tags from quads: levels of black and white as planes fitted to the border and its surroundings, so
/// that light may change across the tag; bits held against their mean; sharpened by several amounts.
class TagReader {
 public:
  explicit TagReader(const ReaderOptions& options) : options_(options) {}

  /// At how many of eight places of the quad's edges, two at each side, there is a step outwards. Cheap.
  [[nodiscard]] int steps_outwards(const ImageView& image, const Quad& quad, const ReadableFamily& family,
                                   bool inverted);

  /// The tag of this family whose border the quad is, with the quad as its corners. `inverted`: a print with
  /// black and white exchanged. O(cells).
  std::optional<TagDetection> read(const ImageView& image, const Quad& quad, const ReadableFamily& family,
                                   bool inverted, ReadProgress& progress);

  /// The same of a tag that something covers along the side after corner `covered` of the quad: levels come
  /// from the other three sides, all of which must be seen, and are taken as even.
  std::optional<TagDetection> read_covered(const ImageView& image, const Quad& quad,
                                           const ReadableFamily& family, bool inverted, std::size_t covered);

 private:
  /// Levels across the tag: constant, change per cell along x and along y, from its middle.
  using Plane = std::array<float, 3>;
  struct Levels {
    Plane border{};
    Plane around{};
    [[nodiscard]] float contrast() const { return around[0] - border[0]; }
  };

  /// Of eight pairs of cells, two at each side, those that differ as a border's do.
  [[nodiscard]] int steps_outwards(const ImageView& image, const ReadableFamily& family) const;
  bool place(const Quad& quad, const ReadableFamily& family, bool inverted);
  Levels sample_border(const ImageView& image, const ReadableFamily& family);
  /// Of the cells along each side, from the quad's first corner on, those that differ from what is outside.
  [[nodiscard]] std::array<int, 4> border_pairs(const ReadableFamily& family, float step) const;
  [[nodiscard]] Levels levels_beside(const ReadableFamily& family, std::size_t covered) const;
  [[nodiscard]] int changes_inside(const ReadableFamily& family) const;
  void sample_inside(const ImageView& image, const ReadableFamily& family);
  void sharpen(const ReadableFamily& family, const Levels& levels, float amount);
  std::optional<TagDetection> decode(const Quad& quad, const ReadableFamily& family);
  /// The known tag that the levels are most evidence for, if they are enough.
  std::optional<TagDetection> decode_known(const Quad& quad, const ReadableFamily& family,
                                           const Levels& levels);
  /// With the levels of the cells on both sides of a shadow's edge made one; nothing where there is none.
  std::optional<TagDetection> decode_in_shadow(const Quad& quad, const ReadableFamily& family);
  /// Without the bits next to a side, which is covered: all others must be right.
  std::optional<TagDetection> decode_beside(const Quad& quad, const ReadableFamily& family,
                                            std::size_t covered);
  [[nodiscard]] std::uint64_t code_of(const ReadableFamily& family, std::size_t turn) const;
  [[nodiscard]] bool believable(const ReadableFamily& family, std::size_t turn, std::uint64_t wrong_bits,
                                std::uint64_t known_bits, float& margin) const;
  [[nodiscard]] float sample(const ImageView& image, float u, float v) const;
  [[nodiscard]] float& cell(const ReadableFamily& family, int x, int y);

  ReaderOptions options_;
  float sign_ = 1;  ///< -1 where the border is bright: levels are then negative, and the border is low again
  Eigen::Matrix3f px_H_cell_ = Eigen::Matrix3f::Identity();
  std::vector<float> levels_;     ///< of the sampled cells
  std::vector<float> distances_;  ///< of the sharpened cells from the threshold
};

}  // namespace waymark::search
