// Compiled with AVX2, BMI and POPCNT (CMakeLists.txt), and called only on processors that have them.
#include <cstring>

#include <immintrin.h>

#include "waymark/tags/detector/plane_kernels.hpp"

namespace waymark::search {
namespace {

constexpr int kStep = 32;  // pixels per register

__m256i load_pixels(const std::uint8_t* pixels) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(pixels));
}

/// The minimum (or maximum) of each group of four neighbouring bytes, in the lowest byte of their 32 bits;
/// the other bytes are 0.
__m256i least_of_four(__m256i v) {
  v = _mm256_min_epu8(v, _mm256_srli_epi32(v, 16));
  v = _mm256_min_epu8(v, _mm256_srli_epi32(v, 8));
  return _mm256_and_si256(v, _mm256_set1_epi32(0xff));
}
__m256i most_of_four(__m256i v) {
  v = _mm256_max_epu8(v, _mm256_srli_epi32(v, 16));
  v = _mm256_max_epu8(v, _mm256_srli_epi32(v, 8));
  return _mm256_and_si256(v, _mm256_set1_epi32(0xff));
}

void tile_extremes_avx2(const std::array<const std::uint8_t*, kTilePx>& rows, int width, std::uint8_t* low,
                        std::uint8_t* high) {
  int x = 0;
  for (; x + kStep <= width; x += kStep) {
    const __m256i a = load_pixels(rows[0] + x);
    const __m256i b = load_pixels(rows[1] + x);
    const __m256i c = load_pixels(rows[2] + x);
    const __m256i d = load_pixels(rows[3] + x);
    const __m256i least = least_of_four(_mm256_min_epu8(_mm256_min_epu8(a, b), _mm256_min_epu8(c, d)));
    const __m256i most = most_of_four(_mm256_max_epu8(_mm256_max_epu8(a, b), _mm256_max_epu8(c, d)));
    // Each half contains the minima of four tiles and the maxima of four tiles.
    const __m256i packed = _mm256_packus_epi16(_mm256_packus_epi32(least, most), _mm256_setzero_si256());
    const auto first = static_cast<std::uint64_t>(_mm256_extract_epi64(packed, 0));
    const auto second = static_cast<std::uint64_t>(_mm256_extract_epi64(packed, 2));
    const std::uint64_t lows = (first & 0xffffffffU) | (second << 32U);
    const std::uint64_t highs = (first >> 32U) | (second & 0xffffffff00000000U);
    std::memcpy(low + x / kTilePx, &lows, sizeof lows);
    std::memcpy(high + x / kTilePx, &highs, sizeof highs);
  }
  if (x == width) return;
  const std::array<const std::uint8_t*, kTilePx> rest = {rows[0] + x, rows[1] + x, rows[2] + x, rows[3] + x};
  portable_plane_kernels().tile_extremes(rest, width - x, low + x / kTilePx, high + x / kTilePx);
}

/// Eight thresholds, each repeated for four pixels.
__m256i spread(const std::uint8_t* thresholds) {
  const __m256i which = _mm256_setr_epi8(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5,
                                         5, 6, 6, 6, 6, 7, 7, 7, 7);
  std::int64_t eight = 0;
  std::memcpy(&eight, thresholds, sizeof eight);
  return _mm256_shuffle_epi8(_mm256_set1_epi64x(eight), which);
}

std::uint64_t below_bits(const std::uint8_t* row, const std::uint8_t* thresholds) {
  const __m256i v = load_pixels(row);
  const __m256i not_below = _mm256_cmpeq_epi8(_mm256_max_epu8(v, spread(thresholds)), v);
  return ~static_cast<std::uint32_t>(_mm256_movemask_epi8(not_below));
}
std::uint64_t above_bits(const std::uint8_t* row, const std::uint8_t* thresholds) {
  const __m256i v = load_pixels(row);
  const __m256i not_above = _mm256_cmpeq_epi8(_mm256_min_epu8(v, spread(thresholds)), v);
  return ~static_cast<std::uint32_t>(_mm256_movemask_epi8(not_above));
}

void below_avx2(const std::uint8_t* row, int width, const std::uint8_t* thresholds, std::uint64_t* words) {
  int x = 0;
  for (; x + 2 * kStep <= width; x += 2 * kStep) {
    const std::uint8_t* t = thresholds + x / kTilePx;
    *words++ = (below_bits(row + x, t) & 0xffffffffU) | (below_bits(row + x + kStep, t + 8) << 32U);
  }
  if (x < width) portable_plane_kernels().below(row + x, width - x, thresholds + x / kTilePx, words);
}

void above_avx2(const std::uint8_t* row, int width, const std::uint8_t* thresholds, std::uint64_t* words) {
  int x = 0;
  for (; x + 2 * kStep <= width; x += 2 * kStep) {
    const std::uint8_t* t = thresholds + x / kTilePx;
    *words++ = (above_bits(row + x, t) & 0xffffffffU) | (above_bits(row + x + kStep, t + 8) << 32U);
  }
  if (x < width) portable_plane_kernels().above(row + x, width - x, thresholds + x / kTilePx, words);
}

}  // namespace

const PlaneKernels* avx2_plane_kernels() {
  static const PlaneKernels kernels = {
      "AVX2",     tile_extremes_avx2, ThresholdRow<struct Avx2Thresholds>::run,
      below_avx2, above_avx2,         RowScan<struct Avx2Rows>::run};
  return &kernels;
}

}  // namespace waymark::search
