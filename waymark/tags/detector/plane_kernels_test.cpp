#include "waymark/tags/detector/plane_kernels.hpp"

#include <algorithm>
#include <cstddef>
#include <iostream>
#include <iterator>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark::search {
namespace {

std::vector<std::uint8_t> random_bytes(std::size_t count, Random& random) {
  std::vector<std::uint8_t> bytes(count);
  // There are few levels, so pixels are often equal to their threshold.
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

TEST(PlaneKernels, HaveNames) {
  for (const PlaneKernels* kernels : runnable_plane_kernels())
    std::cout << kernels->name << " is among the kernels\n";
  EXPECT_STREQ(runnable_plane_kernels().front()->name, "portable");
}

TEST(PlaneKernels, AllVersionsGiveTheSameThresholds) {
  Random random(24);
  for (const PlaneKernels* kernels : runnable_plane_kernels()) {
    for (int round = 0; round < 500; ++round) {
      const std::size_t count = 1 + random.index(100);
      std::vector<std::uint8_t> low = random_bytes(count, random);
      std::vector<std::uint8_t> high = random_bytes(count, random);
      for (std::size_t i = 0; i < count; ++i) {
        if (high[i] < low[i]) std::swap(low[i], high[i]);
      }
      const auto share = static_cast<std::uint16_t>(1 + random.index(128));
      const ThresholdRule rule{random.index(2) == 0, share, static_cast<std::uint8_t>(random.index(256))};
      std::vector<std::uint8_t> given(count), expected(count);
      kernels->thresholds(low.data(), high.data(), count, rule, given.data());
      for (std::size_t i = 0; i < count; ++i) {
        const int range = high[i] - low[i];
        const int step = (range * share + 128) / 256;
        const int level = rule.dark ? low[i] + step : high[i] - step;
        const int nothing = rule.dark ? 0 : 255;
        expected[i] = static_cast<std::uint8_t>(range < rule.gate ? nothing : level);
      }
      ASSERT_EQ(given, expected) << kernels->name;
    }
  }
}

using Pairs = std::vector<std::pair<int, int>>;

Pairs pairs_of(const std::vector<RunPair>& list, std::size_t count) {
  Pairs pairs;
  for (std::size_t i = 0; i < count; ++i) pairs.emplace_back(list[i].above, list[i].here);
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// The ranges [begin, end) of the bits set in a row, found bit by bit.
Pairs runs_of(const std::vector<std::uint64_t>& row) {
  const auto set = [&](std::size_t x) { return x < 64 * row.size() && (row[x / 64] >> (x % 64) & 1U) != 0; };
  Pairs runs;
  for (std::size_t x = 0; x < 64 * row.size(); ++x) {
    if (set(x) && (x == 0 || !set(x - 1))) runs.emplace_back(x, 0);
    if (set(x) && !set(x + 1)) runs.back().second = static_cast<int>(x + 1);
  }
  return runs;
}

TEST(PlaneKernels, AllVersionsGiveTheSameRuns) {
  Random random(25);
  RowRuns rows;  // one workspace for all rows
  for (const PlaneKernels* kernels : runnable_plane_kernels()) {
    for (int round = 0; round < 300; ++round) {
      const std::size_t words = 1 + random.index(5);
      const double density = random.uniform();
      std::vector<std::uint64_t> above(words), row(words);
      rows.begin_plane(static_cast<int>(64 * words));
      for (int y = 0; y < 4; ++y, above = row) {
        for (std::uint64_t& word : row) {
          word = 0;
          for (int bit = 0; bit < 64; ++bit) word = word << 1U | (random.uniform() < density ? 1U : 0U);
        }
        kernels->runs_of_row(row.data(), above.data(), words, rows);
        const Pairs here = runs_of(row);
        Pairs given;
        for (std::size_t i = 0; i < rows.count; ++i) given.emplace_back(rows.begins[i], rows.ends[i]);
        ASSERT_EQ(given, here) << kernels->name;
        const Pairs before = runs_of(above);
        Pairs sides, corners;
        for (int a = 0; a < std::ssize(before); ++a) {
          for (int b = 0; b < std::ssize(here); ++b) {
            const auto& [from, to] = before[static_cast<std::size_t>(a)];
            const auto& [begin, end] = here[static_cast<std::size_t>(b)];
            if (from < end && begin < to) sides.emplace_back(a, b);
            if (from == end || begin == to) corners.emplace_back(a, b);
          }
        }
        ASSERT_EQ(pairs_of(rows.sides, rows.side_count), sides) << kernels->name;
        ASSERT_EQ(pairs_of(rows.corners, rows.corner_count), corners) << kernels->name;
      }
    }
  }
}

TEST(PlaneKernels, ThePortableVersionMatchesItsDefinition) {
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
