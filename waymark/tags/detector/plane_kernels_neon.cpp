// For processors with NEON, which every 64-bit ARM has.
#include "waymark/tags/detector/plane_kernels.hpp"

#if defined(__ARM_NEON) && defined(__aarch64__)
#include <arm_neon.h>

#include <cstring>

namespace waymark::search {
namespace {

constexpr int kStep = 16;  // pixels per register

void tile_extremes_neon(const std::array<const std::uint8_t*, kTilePx>& rows, int width, std::uint8_t* low,
                        std::uint8_t* high) {
  int x = 0;
  for (; x + kStep <= width; x += kStep) {
    const uint8x16_t a = vld1q_u8(rows[0] + x);
    const uint8x16_t b = vld1q_u8(rows[1] + x);
    const uint8x16_t c = vld1q_u8(rows[2] + x);
    const uint8x16_t d = vld1q_u8(rows[3] + x);
    uint8x16_t least = vminq_u8(vminq_u8(a, b), vminq_u8(c, d));
    uint8x16_t most = vmaxq_u8(vmaxq_u8(a, b), vmaxq_u8(c, d));
    least = vpminq_u8(least, least);  // minima of pairs, in the lower half
    most = vpmaxq_u8(most, most);
    least = vpminq_u8(least, least);
    most = vpmaxq_u8(most, most);
    vst1q_lane_u32(reinterpret_cast<std::uint32_t*>(low + x / kTilePx), vreinterpretq_u32_u8(least), 0);
    vst1q_lane_u32(reinterpret_cast<std::uint32_t*>(high + x / kTilePx), vreinterpretq_u32_u8(most), 0);
  }
  if (x == width) return;
  const std::array<const std::uint8_t*, kTilePx> rest = {rows[0] + x, rows[1] + x, rows[2] + x, rows[3] + x};
  portable_plane_kernels().tile_extremes(rest, width - x, low + x / kTilePx, high + x / kTilePx);
}

/// Four thresholds, each repeated for four pixels.
uint8x16_t spread(const std::uint8_t* thresholds) {
  static const std::uint8_t kWhich[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
  std::uint32_t four = 0;
  std::memcpy(&four, thresholds, sizeof four);
  return vqtbl1q_u8(vreinterpretq_u8_u32(vdupq_n_u32(four)), vld1q_u8(kWhich));
}

/// One bit for each of the 64 bytes in four masks, lowest bit first.
std::uint64_t gathered(const uint8x16_t masks[4]) {
  static const std::uint8_t kBit[16] = {1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128};
  const uint8x16_t bit = vld1q_u8(kBit);
  const uint8x16_t ab = vpaddq_u8(vandq_u8(masks[0], bit), vandq_u8(masks[1], bit));
  const uint8x16_t cd = vpaddq_u8(vandq_u8(masks[2], bit), vandq_u8(masks[3], bit));
  uint8x16_t all = vpaddq_u8(ab, cd);
  all = vpaddq_u8(all, all);
  return vgetq_lane_u64(vreinterpretq_u64_u8(all), 0);
}

void below_neon(const std::uint8_t* row, int width, const std::uint8_t* thresholds, std::uint64_t* words) {
  int x = 0;
  for (; x + 4 * kStep <= width; x += 4 * kStep) {
    uint8x16_t masks[4];
    for (int i = 0; i < 4; ++i)
      masks[i] = vcltq_u8(vld1q_u8(row + x + i * kStep), spread(thresholds + x / kTilePx + 4 * i));
    *words++ = gathered(masks);
  }
  if (x < width) portable_plane_kernels().below(row + x, width - x, thresholds + x / kTilePx, words);
}

void above_neon(const std::uint8_t* row, int width, const std::uint8_t* thresholds, std::uint64_t* words) {
  int x = 0;
  for (; x + 4 * kStep <= width; x += 4 * kStep) {
    uint8x16_t masks[4];
    for (int i = 0; i < 4; ++i)
      masks[i] = vcgtq_u8(vld1q_u8(row + x + i * kStep), spread(thresholds + x / kTilePx + 4 * i));
    *words++ = gathered(masks);
  }
  if (x < width) portable_plane_kernels().above(row + x, width - x, thresholds + x / kTilePx, words);
}

}  // namespace

const PlaneKernels* neon_plane_kernels() {
  static const PlaneKernels kernels = {
      "NEON",     tile_extremes_neon, ThresholdRow<struct NeonThresholds>::run,
      below_neon, above_neon,         RowScan<struct NeonRows>::run};
  return &kernels;
}

}  // namespace waymark::search
#endif
