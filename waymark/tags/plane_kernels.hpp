#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/tags/row_runs.hpp"

/// The steps of the detector that touch every pixel, one version for each kind of processor. All versions
/// give the same bytes (plane_kernels_test.cpp).
namespace waymark::search {

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

}  // namespace waymark::search
