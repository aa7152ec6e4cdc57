// How much the levels of a tag's cells say for a code, and known tags that are read by it.
#include "waymark/tags/soft_bits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "waymark/base/random.hpp"
#include "waymark/tags/waymark_detector.hpp"

namespace waymark {
namespace {

constexpr std::uint64_t kSeed = 20261128;
using search::evidence_bits;
using testing::paint_cells;
using testing::paint_tag;
using testing::square_corners;

/// Cells 0 to n - 1 are the bits.
std::vector<std::uint16_t> cells_of(std::size_t count) {
  std::vector<std::uint16_t> cells(count);
  std::iota(cells.begin(), cells.end(), std::uint16_t{0});
  return cells;
}

TEST(Evidence, GrowsWithSureBitsAndShrinksWithWrongOnes) {
  const auto cells = cells_of(36);
  const std::vector<float> sure(36, 50);
  const float all = evidence_bits(sure, cells, 0);
  EXPECT_GT(all, 30);
  EXPECT_LE(all, 36);
  EXPECT_LT(evidence_bits(sure, cells, 1), all - 4) << "a sure bit that is wrong";
  std::vector<float> doubtful = sure;
  doubtful[35] = 2;  // least significant
  EXPECT_GT(evidence_bits(doubtful, cells, 1), evidence_bits(sure, cells, 1) + 2) << "one nearly undecided";
  EXPECT_EQ(evidence_bits(std::vector<float>(36, 0), cells, 0), 0);
  std::vector<float> half = sure;
  for (float& level : half) level *= 0.01F;
  EXPECT_NEAR(evidence_bits(half, cells, 0), all, 1e-3) << "whatever the contrast";
}

/// The law that the threshold of known tags rests on: under bits at random the likelihood ratio has the mean
/// 1, so that t bits are reached with a probability of at most 2^-t.
TEST(Evidence, BitsAtRandomReachItAsSeldomAsMarkovSays) {
  Random random(kSeed);
  std::cout << "seed " << kSeed << "\n";
  constexpr int kTrials = 200'000;
  const auto cells = cells_of(16);
  std::vector<float> distances(16);
  double mean = 0;
  std::array<int, 9> reached{};
  for (int i = 0; i < kTrials; ++i) {
    for (float& distance : distances) distance = static_cast<float>(std::abs(random.normal()) * 30 + 5);
    std::uint64_t wrong = 0;
    for (int bit = 0; bit < 16; ++bit) wrong = wrong << 1U | (random.uniform(0, 1) < 0.5 ? 1U : 0U);
    const float evidence = evidence_bits(distances, cells, wrong);
    mean += std::exp2(static_cast<double>(evidence)) / kTrials;
    for (std::size_t t = 0; t < reached.size(); ++t)
      reached.at(t) += evidence >= static_cast<float>(t) ? 1 : 0;
  }
  EXPECT_LT(mean, 1.5);
  for (std::size_t t = 1; t < reached.size(); ++t)
    EXPECT_LE(reached.at(t), kTrials * std::exp2(-static_cast<double>(t))) << t << " bits";
}

/// Some bits of tag 7 are grey, a little on the wrong side of the threshold.
Image with_grey_bits(std::size_t count) {
  constexpr std::array<std::size_t, 8> kBits = {2, 9, 16, 23, 30, 34, 12, 27};
  Image image(220, 220, 140);
  const TagId tag{FamilyId::Tag36h11, 7};
  const Family& tags = family(tag.family);
  const auto corners = square_corners({110, 110}, 100, 0.2);
  paint_tag(image, tag, corners);
  std::vector<std::uint8_t> cells = bitmap(tag);
  const int margin = (tags.total_width - tags.width_at_border) / 2;
  std::vector<std::uint8_t> grey(cells.size(), 128);  // not painted
  for (std::size_t i = 0; i < count; ++i) {
    const BitCell& cell = tags.bits[kBits.at(i)];
    const auto at = static_cast<std::size_t>((cell.y + margin) * tags.total_width + cell.x + margin);
    grey[at] = cells[at];
  }
  paint_cells(image, tags, grey, corners, 150, 100);
  return image;
}

DetectorOptions knowing(const std::vector<int>& numbers) {
  DetectorOptions options;
  for (const int number : numbers) options.known_tags.push_back({FamilyId::Tag36h11, number});
  return options;
}

TEST(KnownTags, AreReadWithMoreWrongBits) {
  const auto plain = make_waymark_detector().value();
  const auto known = make_waymark_detector(knowing({1, 7, 12})).value();
  const auto others = make_waymark_detector(knowing({1, 12})).value();
  for (const std::size_t count : {3U, 4U}) {
    const Image image = with_grey_bits(count);
    EXPECT_TRUE(plain->detect(image).value().empty()) << count;
    EXPECT_TRUE(others->detect(image).value().empty()) << count << ": tag 7 is not one of them";
    const auto found = known->detect(image).value();
    ASSERT_EQ(found.size(), 1U) << count;
    EXPECT_EQ(found[0].tag.number, 7);
    EXPECT_EQ(found[0].hamming, static_cast<int>(count));
  }
  EXPECT_TRUE(known->detect(with_grey_bits(7)).value().empty()) << "too many";
}

TEST(KnownTags, NumbersThatTheFamilyDoesNotHaveCountAsNone) {
  EXPECT_TRUE(make_waymark_detector(knowing({-1, 587, 1'000'000})));
}

}  // namespace
}  // namespace waymark
