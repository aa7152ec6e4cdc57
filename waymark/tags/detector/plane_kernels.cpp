#include "waymark/tags/detector/plane_kernels.hpp"

#include <algorithm>

namespace waymark::search {
namespace {

constexpr int kWordBits = 64;

void tile_extremes_portable(const std::array<const std::uint8_t*, kTilePx>& rows, int width,
                            std::uint8_t* low, std::uint8_t* high) {
  for (int x = 0; x < width; x += kTilePx, ++low, ++high) {
    std::uint8_t least = 255;
    std::uint8_t most = 0;
    const int end = std::min(x + kTilePx, width);
    for (const std::uint8_t* row : rows) {
      for (int i = x; i < end; ++i) {
        least = std::min(least, row[i]);
        most = std::max(most, row[i]);
      }
    }
    *low = least;
    *high = most;
  }
}

template <class Inside>
void bits_of_row(const std::uint8_t* row, int width, const std::uint8_t* thresholds, std::uint64_t* words,
                 Inside&& inside) {
  for (int x = 0; x < width; x += kWordBits, ++words) {
    std::uint64_t word = 0;
    const int count = std::min(kWordBits, width - x);
    for (int i = 0; i < count; ++i) {
      const bool set = inside(row[x + i], thresholds[(x + i) / kTilePx]);
      word |= static_cast<std::uint64_t>(set ? 1 : 0) << static_cast<unsigned>(i);
    }
    *words = word;
  }
}

void below_portable(const std::uint8_t* row, int width, const std::uint8_t* thresholds,
                    std::uint64_t* words) {
  bits_of_row(row, width, thresholds, words, [](std::uint8_t pixel, std::uint8_t t) { return pixel < t; });
}

void above_portable(const std::uint8_t* row, int width, const std::uint8_t* thresholds,
                    std::uint64_t* words) {
  bits_of_row(row, width, thresholds, words, [](std::uint8_t pixel, std::uint8_t t) { return pixel > t; });
}

}  // namespace

const PlaneKernels& portable_plane_kernels() {
  static const PlaneKernels kernels = {
      "portable",     tile_extremes_portable, ThresholdRow<struct PortableThresholds>::run,
      below_portable, above_portable,         RowScan<struct PortableRows>::run};
  return kernels;
}

#ifndef WAYMARK_AVX2
const PlaneKernels* avx2_plane_kernels() { return nullptr; }
#endif
#if !defined(__ARM_NEON) || !defined(__aarch64__)
const PlaneKernels* neon_plane_kernels() { return nullptr; }
#endif

std::vector<const PlaneKernels*> runnable_plane_kernels() {
  std::vector<const PlaneKernels*> all = {&portable_plane_kernels()};
  if (neon_plane_kernels() != nullptr) all.push_back(neon_plane_kernels());
#ifdef WAYMARK_AVX2
  const bool has_all = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("bmi") != 0 &&
                       __builtin_cpu_supports("popcnt") != 0;
  if (has_all) all.push_back(avx2_plane_kernels());
#endif
  return all;
}

const PlaneKernels& best_plane_kernels() {
  static const PlaneKernels& kernels = *runnable_plane_kernels().back();
  return kernels;
}

}  // namespace waymark::search
