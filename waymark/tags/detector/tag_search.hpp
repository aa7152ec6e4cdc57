#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/detector/bit_grid.hpp"
#include "waymark/tags/detector/components.hpp"
#include "waymark/tags/detector/quads.hpp"
#include "waymark/tags/detector/tag_reader.hpp"

namespace waymark::search {

/// The boxes of the components that have been examined, in a hash set with open addressing. Does not allocate
/// once it has grown.
class BoxSet {
 public:
  void clear() {
    std::ranges::fill(slots_, kFree);
    count_ = 0;
  }

  /// Returns false if a component with the same box has already been inserted.
  bool insert(const Component& component) {
    if (2 * count_ >= slots_.size()) grow();
    return insert_key(key_of(component));
  }

 private:
  static constexpr std::uint64_t kFree = 0;  // cannot be a box, because x1 and y1 are at least 1

  static std::uint64_t key_of(const Component& c) {
    const auto part = [](std::int16_t value) {
      return static_cast<std::uint64_t>(static_cast<std::uint16_t>(value));
    };
    return part(c.x0) | part(c.x1) << 16U | part(c.y0) << 32U | part(c.y1) << 48U;
  }

  bool insert_key(std::uint64_t key) {
    constexpr std::uint64_t kMix = 0x9e3779b97f4a7c15U;
    std::size_t at = (key * kMix >> 32U) & (slots_.size() - 1);
    while (slots_[at] != kFree) {
      if (slots_[at] == key) return false;
      at = (at + 1) & (slots_.size() - 1);
    }
    slots_[at] = key;
    ++count_;
    return true;
  }

  void grow() {
    std::vector<std::uint64_t> before(2 * slots_.size(), kFree);
    before.swap(slots_);
    count_ = 0;
    for (const std::uint64_t key : before) {
      if (key != kFree) insert_key(key);
    }
  }

  std::vector<std::uint64_t> slots_ = std::vector<std::uint64_t>(1024, kFree);  // the size is a power of two
  std::size_t count_ = 0;
};

struct SearchOptions {
  int min_white_black_diff = 15;
  double min_decision_margin = 0;
  bool find_inverted = false;
};

/// The work done in one search, for tests of its cost.
struct SearchCounts {
  std::size_t runs = 0;
  std::size_t components = 0;
  std::size_t quads = 0;
  std::size_t borders = 0;  ///< number of quads whose bits were read
};

/// Searches for the tags in one image, with a workspace of its own; each thread needs a separate instance.
/// The steps are thresholding into bit planes, connected components, quads, and bits
/// (docs/concepts/detection.md).
class TagSearch {
 public:
  explicit TagSearch(const SearchOptions& options, const PlaneKernels& kernels = best_plane_kernels());

  /// The tags of these families, in the order in which they are found. The reference is valid until the next
  /// call. Does not allocate once the workspace has grown. O(pixels / 64 + runs + quads).
  const std::vector<TagDetection>& run(const ImageView& image, const std::vector<ReadableFamily>& families);

  [[nodiscard]] const SearchCounts& counts() const { return counts_; }

 private:
  /// A family and a polarity to search for.
  struct Wanted {
    const ReadableFamily* family = nullptr;
    bool inverted = false;
  };
  /// An attempt to read a quad, with the parameters of the next retry.
  struct Attempt {
    Quad outline;
    Quad sharpened;
    float cell_px = 0;
    float reach_px = 0;  ///< initial reach of the edge search on either side of the outline
    int sign = 1;        ///< 1 if the image is brighter outside the quad, -1 if darker
    bool far = false;    ///< the outline is imprecise
  };

  void search_polarity(const ImageView& image, Polarity polarity);
  void search_plane(const ImageView& image, Polarity polarity, bool diagonals);
  void search_components(const ImageView& image, Polarity polarity, bool joined);
  void search_component(const ImageView& image, Polarity polarity, const Component& component);
  bool read_outline(const ImageView& image, Attempt& attempt);
  [[nodiscard]] bool has_steps_outwards(const ImageView& image, const Quad& quad, int least);
  bool read_any(const ImageView& image, const Quad& quad, ReadProgress& best);
  bool read_covered(const ImageView& image, const Quad& quad);
  bool keep(const ImageView& image, const Wanted& wanted, TagDetection tag);
  bool read_varied(const ImageView& image, const Attempt& attempt);
  bool read_overexposed(const ImageView& image, const Attempt& attempt);
  [[nodiscard]] bool overexposed(const std::array<Eigen::Vector2d, 4>& corners_px) const;
  [[nodiscard]] bool may_be_frame(const ImageView& image, const Component& component) const;
  [[nodiscard]] bool known(const Quad& quad) const;

  SearchOptions options_;
  const PlaneKernels* kernels_;
  Tiles tiles_;
  BitPlane plane_;
  RunComponents components_;
  QuadFitter fitter_;
  TagReader reader_;
  BitGrid grid_;
  std::vector<Wanted> wanted_;
  int least_width_ = 1;  ///< smallest width in cells among the families searched for
  int gate_ = 0;
  BoxSet boxes_;  ///< boxes of the components of this polarity so far
  std::vector<TagDetection> found_;
  SearchCounts counts_;
};

}  // namespace waymark::search
