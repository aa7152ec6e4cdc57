#include "waymark/tags/plane_kernels.hpp"

#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark::search {
namespace {

std::vector<std::uint8_t> random_bytes(std::size_t count, Random& random) {
  std::vector<std::uint8_t> bytes(count);
  // Few levels: pixels that equal their threshold are frequent.
  const std::uint64_t levels = 2 + random.index(255);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(255 - random.index(levels));
  return bytes;
}

TEST(PlaneKernels, AllVersionsGiveTheSameBytes) {
  Random random(23);
  const PlaneKernels& portable = portable_plane_kernels();
  for (const PlaneKernels* kernels : runnable_plane_kernels()) {
    for (int round = 0; round < 2000; ++round) {
      const int width = 1 + static_cast<int>(random.index(300));
      const auto n = static_cast<std::size_t>(width);
      const std::size_t tiles = (n + 3) / 4;
      const std::vector<std::uint8_t> pixels = random_bytes(4 * n, random);
      const std::array<const std::uint8_t*, kTilePx> rows = {&pixels[0], &pixels[n], &pixels[2 * n],
                                                             &pixels[3 * n]};
      std::vector<std::uint8_t> low(tiles), high(tiles), low_portable(tiles), high_portable(tiles);
      kernels->tile_extremes(rows, width, low.data(), high.data());
      portable.tile_extremes(rows, width, low_portable.data(), high_portable.data());
      ASSERT_EQ(low, low_portable) << kernels->name << ", width " << width;
      ASSERT_EQ(high, high_portable) << kernels->name << ", width " << width;

      const std::vector<std::uint8_t> thresholds = random_bytes(tiles, random);
      std::vector<std::uint64_t> words((n + 63) / 64), words_portable(words.size());
      kernels->below(pixels.data(), width, thresholds.data(), words.data());
      portable.below(pixels.data(), width, thresholds.data(), words_portable.data());
      ASSERT_EQ(words, words_portable) << kernels->name << ", width " << width;
      kernels->above(pixels.data(), width, thresholds.data(), words.data());
      portable.above(pixels.data(), width, thresholds.data(), words_portable.data());
      ASSERT_EQ(words, words_portable) << kernels->name << ", width " << width;
    }
  }
}

TEST(PlaneKernels, ThePortableOneDoesWhatItSays) {
  const std::vector<std::uint8_t> row = {5, 10, 15, 20, 0, 255, 9, 10, 11};
  const std::vector<std::uint8_t> thresholds = {15, 10, 255};
  std::uint64_t word = 0;
  portable_plane_kernels().below(row.data(), 9, thresholds.data(), &word);
  EXPECT_EQ(word, 0b1'0101'0011U);
  portable_plane_kernels().above(row.data(), 9, thresholds.data(), &word);
  EXPECT_EQ(word, 0b0'0010'1000U);
  std::vector<std::uint8_t> low(3), high(3);
  const std::array<const std::uint8_t*, kTilePx> rows = {row.data(), row.data(), row.data(), row.data()};
  portable_plane_kernels().tile_extremes(rows, 9, low.data(), high.data());
  EXPECT_EQ(low, (std::vector<std::uint8_t>{5, 0, 11}));
  EXPECT_EQ(high, (std::vector<std::uint8_t>{20, 255, 11}));
}

}  // namespace
}  // namespace waymark::search
