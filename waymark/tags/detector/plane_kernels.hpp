#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// The steps of the detector that touch every pixel, one version for each kind of processor. All versions
/// give the same bytes (plane_kernels_test.cpp).
namespace waymark::search {

/// A run of the row above and one of this row, counted from the left, that touch each other.
struct RunPair {
  std::uint16_t above = 0, here = 0;
};

/// Where the runs of a row begin and end, 64 columns a word, and how many begin before each word.
struct RowEdges {
  std::vector<std::uint64_t> begins, ends;
  std::vector<std::uint16_t> before;
};

/// The runs of one row of a bit plane, and how they touch those of the row above.
struct RowRuns {
  std::vector<std::int16_t> begins, ends;  ///< columns [begin, end); beyond `count` there is room only
  std::vector<RunPair> sides;              ///< pairs that share the side of a pixel, from left to right
  std::vector<RunPair> corners;            ///< pairs that share but the corner of a pixel, in no order
  std::size_t count = 0, side_count = 0, corner_count = 0;
  bool with_corners = true;  ///< whether `corners` are wanted
  RowEdges here, above;      ///< of the row and of the one before it

  /// Room for rows of this width, and an empty row above the first one.
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

/// Where the threshold of a tile lies between the least and the greatest level of its window.
struct ThresholdRule {
  bool dark = true;  ///< pixels below it are wanted, else those above it
  /// Share of the range of the window between its darkest (dark) or brightest level and the threshold, in
  /// 256ths; up to 128.
  std::uint16_t share_256 = 128;
  std::uint8_t gate = 15;  ///< [grey level] windows of a smaller range hold nothing
};

struct PlaneKernels {
  const char* name = "";
  /// Least and greatest level of each tile of kTilePx x kTilePx pixels; the last one may be narrower. The
  /// four rows need not be different. Writes (width + 3) / 4 bytes to each.
  void (*tile_extremes)(const std::array<const std::uint8_t*, kTilePx>& rows, int width, std::uint8_t* low,
                        std::uint8_t* high) = nullptr;
  /// The threshold of each of some tiles, from the least and the greatest level of its window.
  void (*thresholds)(const std::uint8_t* low, const std::uint8_t* high, std::size_t count,
                     const ThresholdRule& rule, std::uint8_t* thresholds) = nullptr;
  /// Bit i of the row is set where pixel i is below the threshold of its tile. Writes (width + 63) / 64
  /// words; bits beyond the width are 0.
  void (*below)(const std::uint8_t* row, int width, const std::uint8_t* thresholds,
                std::uint64_t* words) = nullptr;
  /// The same where the pixel is above it.
  void (*above)(const std::uint8_t* row, int width, const std::uint8_t* thresholds,
                std::uint64_t* words) = nullptr;
  /// Runs of a row of a bit plane and how they touch those of the row above; row after row, beginning with
  /// RowRuns::begin_plane() and a row above of zeros. Bits beyond the width are 0.
  void (*runs_of_row)(const std::uint64_t* row, const std::uint64_t* above, std::size_t words,
                      RowRuns& runs) = nullptr;
};

/// For every processor.
[[nodiscard]] const PlaneKernels& portable_plane_kernels();
/// For processors with AVX2 and with NEON. Nothing where they were not compiled in; whether the processor can
/// run them is another question.
[[nodiscard]] const PlaneKernels* avx2_plane_kernels();
[[nodiscard]] const PlaneKernels* neon_plane_kernels();
/// All that this processor can run, the quickest last.
[[nodiscard]] std::vector<const PlaneKernels*> runnable_plane_kernels();
/// The quickest of them; chosen once.
[[nodiscard]] const PlaneKernels& best_plane_kernels();

/// PlaneKernels::runs_of_row, by whole words. Each `Processor` is a version of its own, compiled with what
/// that processor can do. O(words + runs).
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

  /// The columns of the bits of a word. Four are written at once, which spares a branch for each.
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
      // The last run of either row that begins at one of these columns or before.
      const auto pair = [&](std::uint64_t above_columns, std::uint64_t columns) {
        return RunPair{
            static_cast<std::uint16_t>(out.above.before[i] + ones(above_begins & above_columns) - 1),
            static_cast<std::uint16_t>(out.here.before[i] + ones(begins & columns) - 1)};
      };
      // Where two runs share sides, they do so once: at the first column of both.
      std::uint64_t touching = (begins & above[i]) | (row[i] & above_begins);
      for (; touching != 0; touching &= touching - 1) {
        const std::uint64_t columns = touching ^ (touching - 1);
        *side++ = pair(columns, columns);
      }
      if (!out.with_corners) continue;
      std::uint64_t after = begins & out.above.ends[i];  // the run above ends where one begins here
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

/// PlaneKernels::thresholds as loops that a compiler makes vectors of; each `Processor` is a version of its
/// own, compiled with what that processor can do.
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
