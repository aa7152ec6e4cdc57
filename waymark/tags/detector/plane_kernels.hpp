#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// The per-pixel steps of the detector, with one implementation for each instruction set. All implementations
/// produce identical bytes (plane_kernels_test.cpp).
namespace waymark::search {

/// A run in the row above and a run in this row that touch, as indices counted from the left.
struct RunPair {
  std::uint16_t above = 0, here = 0;
};

/// Begins and ends of the runs in a row, 64 columns per word, and the number of runs before each word.
struct RowEdges {
  std::vector<std::uint64_t> begins, ends;
  std::vector<std::uint16_t> before;
};

/// The runs in one row of a bit plane, and their contacts with the runs in the row above.
struct RowRuns {
  std::vector<std::int16_t> begins, ends;  ///< columns [begin, end); entries beyond `count` are unused
  std::vector<RunPair> sides;              ///< pairs that share a pixel side, from left to right
  std::vector<RunPair> corners;            ///< pairs that share only a pixel corner, in no particular order
  std::size_t count = 0, side_count = 0, corner_count = 0;
  bool with_corners = true;  ///< whether `corners` is needed
  RowEdges here, above;      ///< edges in this row and in the previous one

  /// Allocates memory for rows of this width, and an empty row above the first one.
  void begin_plane(int width, bool corners_too = true) {
    with_corners = corners_too;
    constexpr std::size_t kWrittenAtOnce = 4;
    const std::size_t runs = static_cast<std::size_t>(width) / 2 + 1 + kWrittenAtOnce;
    const std::size_t words = (static_cast<std::size_t>(width) + 63) / 64;
    begins.resize(runs);
    ends.resize(runs);
    sides.resize(2 * runs);
    corners.resize(2 * runs);
    for (RowEdges* edges : {&here, &above}) {
      edges->begins.assign(words, 0);
      edges->ends.assign(words, 0);
      edges->before.assign(words, 0);
    }
  }
};

inline constexpr int kTilePx = 4;

/// The position of a tile's threshold between the minimum and the maximum level in its window.
struct ThresholdRule {
  bool dark = true;  ///< if true, selects pixels below the threshold, otherwise those above it
  /// Distance of the threshold from the darkest (if `dark`) or brightest level in the window, as a share of
  /// the range of levels, in 256ths; at most 128.
  std::uint16_t share_256 = 128;
  std::uint8_t gate = 15;  ///< [grey level] nothing is selected in windows with a smaller range
};

struct PlaneKernels {
  const char* name = "";
  /// Minimum and maximum level in each tile of kTilePx x kTilePx pixels; the last tile may be narrower. The
  /// four rows may coincide. Writes (width + 3) / 4 bytes to each output.
  void (*tile_extremes)(const std::array<const std::uint8_t*, kTilePx>& rows, int width, std::uint8_t* low,
                        std::uint8_t* high) = nullptr;
  /// The threshold for each tile, from the minimum and maximum level in its window.
  void (*thresholds)(const std::uint8_t* low, const std::uint8_t* high, std::size_t count,
                     const ThresholdRule& rule, std::uint8_t* thresholds) = nullptr;
  /// Sets bit i of the row if pixel i is below the threshold for its tile. Writes (width + 63) / 64 words;
  /// bits beyond the width are 0.
  void (*below)(const std::uint8_t* row, int width, const std::uint8_t* thresholds,
                std::uint64_t* words) = nullptr;
  /// The same for pixels above the threshold.
  void (*above)(const std::uint8_t* row, int width, const std::uint8_t* thresholds,
                std::uint64_t* words) = nullptr;
  /// The runs in a row of a bit plane, and their contacts with the runs in the row above. Called row by row
  /// after RowRuns::begin_plane(), with zeros above the first row. Bits beyond the width must be 0.
  void (*runs_of_row)(const std::uint64_t* row, const std::uint64_t* above, std::size_t words,
                      RowRuns& runs) = nullptr;
};

/// The portable implementation.
[[nodiscard]] const PlaneKernels& portable_plane_kernels();
/// Implementations for processors with AVX2 and with NEON; nullptr if not compiled in. The processor may
/// still lack the instructions.
[[nodiscard]] const PlaneKernels* avx2_plane_kernels();
[[nodiscard]] const PlaneKernels* neon_plane_kernels();
/// All implementations that this processor can run, with the fastest last.
[[nodiscard]] std::vector<const PlaneKernels*> runnable_plane_kernels();
/// The fastest implementation that this processor can run, selected once.
[[nodiscard]] const PlaneKernels& best_plane_kernels();

/// Implements PlaneKernels::runs_of_row by processing whole words. Each `Processor` has its own
/// instantiation, compiled for that instruction set. O(words + runs).
template <class Processor>
class RowScan {
 public:
  static void run(const std::uint64_t* row, const std::uint64_t* above, std::size_t words, RowRuns& out) {
    out.here.begins.swap(out.above.begins);
    out.here.ends.swap(out.above.ends);
    out.here.before.swap(out.above.before);
    find_edges(row, words, out);
    find_pairs(row, above, words, out);
  }

 private:
  static std::size_t ones(std::uint64_t bits) { return static_cast<std::size_t>(__builtin_popcountll(bits)); }

  /// Writes the columns of the bits set in a word. Writes four columns at once, which saves a branch per
  /// column.
  [[gnu::always_inline]] static inline std::int16_t* append(std::int16_t* to, std::size_t word,
                                                            std::uint64_t bits) {
    constexpr std::uint64_t kLastBit = std::uint64_t{1} << 63U;
    std::int16_t* const end = to + ones(bits);
    for (; to < end; to += 4) {
      for (std::size_t k = 0; k < 4; ++k) {
        to[k] = static_cast<std::int16_t>(static_cast<int>(64 * word) + __builtin_ctzll(bits | kLastBit));
        bits &= bits - 1;
      }
    }
    return end;
  }

  static void find_edges(const std::uint64_t* row, std::size_t words, RowRuns& out) {
    std::int16_t* begin = out.begins.data();
    std::int16_t* end = out.ends.data();
    std::uint64_t left = 0;
    for (std::size_t i = 0; i < words; ++i) {
      const std::uint64_t here = row[i];
      const std::uint64_t shifted = here << 1U | left;
      const std::uint64_t begins = here & ~shifted;
      const std::uint64_t ends = shifted & ~here;
      left = here >> 63U;
      out.here.begins[i] = begins;
      out.here.ends[i] = ends;
      out.here.before[i] = static_cast<std::uint16_t>(begin - out.begins.data());
      if (begins != 0) begin = append(begin, i, begins);
      if (ends != 0) end = append(end, i, ends);
    }
    if (left != 0) *end = static_cast<std::int16_t>(64 * words);
    out.count = static_cast<std::size_t>(begin - out.begins.data());
  }

  static void find_pairs(const std::uint64_t* row, const std::uint64_t* above, std::size_t words,
                         RowRuns& out) {
    RunPair* side = out.sides.data();
    RunPair* corner = out.corners.data();
    for (std::size_t i = 0; i < words; ++i) {
      const std::uint64_t begins = out.here.begins[i];
      const std::uint64_t above_begins = out.above.begins[i];
      // In each row, the last run that begins at or before one of these columns.
      const auto pair = [&](std::uint64_t above_columns, std::uint64_t columns) {
        return RunPair{
            static_cast<std::uint16_t>(out.above.before[i] + ones(above_begins & above_columns) - 1),
            static_cast<std::uint16_t>(out.here.before[i] + ones(begins & columns) - 1)};
      };
      // If two runs share pixel sides, they do so in one contiguous range, which is reported at its first
      // column.
      std::uint64_t touching = (begins & above[i]) | (row[i] & above_begins);
      for (; touching != 0; touching &= touching - 1) {
        const std::uint64_t columns = touching ^ (touching - 1);
        *side++ = pair(columns, columns);
      }
      if (!out.with_corners) continue;
      std::uint64_t after = begins & out.above.ends[i];  // the run above ends where a run begins here
      std::uint64_t before = out.here.ends[i] & above_begins;
      for (; after != 0; after &= after - 1) {
        const std::uint64_t columns = after ^ (after - 1);
        *corner++ = pair(columns >> 1U, columns);
      }
      for (; before != 0; before &= before - 1) {
        const std::uint64_t columns = before ^ (before - 1);
        *corner++ = pair(columns, columns >> 1U);
      }
    }
    out.side_count = static_cast<std::size_t>(side - out.sides.data());
    out.corner_count = static_cast<std::size_t>(corner - out.corners.data());
  }
};

/// Implements PlaneKernels::thresholds with loops that the compiler vectorises. Each `Processor` has its own
/// instantiation, compiled for that instruction set.
template <class Processor>
struct ThresholdRow {
  static void run(const std::uint8_t* __restrict low, const std::uint8_t* __restrict high, std::size_t count,
                  const ThresholdRule& rule, std::uint8_t* __restrict thresholds) {
    const std::uint16_t share = rule.share_256;
    const std::uint8_t gate = rule.gate;
    for (std::size_t i = 0; i < count; ++i) {
      const auto range = static_cast<std::uint16_t>(high[i] - low[i]);
      const auto step = static_cast<std::uint8_t>(static_cast<std::uint16_t>(range * share + 128U) >> 8U);
      thresholds[i] = rule.dark ? static_cast<std::uint8_t>(range < gate ? 0 : low[i] + step)
                                : static_cast<std::uint8_t>(range < gate ? 255 : high[i] - step);
    }
  }
};

}  // namespace waymark::search
