#include "waymark/tags/detector/tag_reader.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iostream>
#include <memory>
#include <numbers>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "waymark/base/random.hpp"
#include "waymark/tags/detector/waymark_detector.hpp"

namespace waymark::search {
namespace {

TEST(CodeIndex, MatchesAnExhaustiveSearch) {
  Random random(11);
  for (const FamilyId id : kAllFamilies) {
    const Family& kind = family(id);
    const auto bits = static_cast<unsigned>(kind.bits.size());
    for (int most = 0; most <= 3; ++most) {
      const CodeIndex index(kind, most);
      for (int round = 0; round < 40; ++round) {
        std::uint64_t code = kind.codes[random.index(kind.codes.size())];
        const std::uint64_t flips = random.index(5);
        for (std::uint64_t i = 0; i < flips; ++i) code ^= std::uint64_t{1} << random.index(bits);
        int best = 99;
        int number = -1;
        for (std::size_t i = 0; i < kind.codes.size(); ++i) {
          const int distance = std::popcount(kind.codes[i] ^ code);
          if (distance < best) {
            best = distance;
            number = static_cast<int>(i);
          }
        }
        const auto found = index.find(code);
        ASSERT_EQ(found.has_value(), best <= most) << kind.name;
        if (!found) continue;
        EXPECT_EQ(found->distance, best) << kind.name;
        EXPECT_EQ(found->number, number) << kind.name;
      }
    }
  }
}

TEST(CodeIndex, FindsTheOnlyCodeWithTheKnownBits) {
  Random random(12);
  const Family& kind = family(FamilyId::Tag36h11);
  const CodeIndex index(kind, 0);
  for (int round = 0; round < 40; ++round) {
    const auto number = static_cast<int>(random.index(kind.codes.size()));
    const std::uint64_t code = kind.codes[static_cast<std::size_t>(number)];
    std::uint64_t known = (std::uint64_t{1} << 36U) - 1;
    for (int i = 0; i < 6; ++i)
      known &= ~(std::uint64_t{1} << random.index(36));  // fewer than the minimum distance of 11
    EXPECT_EQ(index.find_exact(code ^ ~known, known), number);
    EXPECT_FALSE(index.find_exact(code ^ (known & ~(known - 1)), known)) << "a known bit is wrong";
  }
  EXPECT_FALSE(index.find_exact(0, 0)) << "all codes match";
}

constexpr int kWidth = 8;
constexpr int kSide = kWidth + 2;
constexpr float kBlack = 40;
constexpr float kWhite = 200;

/// The cells of a tag with random bits, darkened where normal . place is less than the offset.
struct Shaded {
  std::vector<float> lit;
  std::vector<float> seen;
  std::vector<float> share;  ///< illuminated share of each cell, computed from sub-samples

  Shaded(Random& random, double angle, double offset, float light_in_shadow) {
    for (int y = -1; y <= kWidth; ++y) {
      for (int x = -1; x <= kWidth; ++x) {
        const bool outside = x < 0 || y < 0 || x == kWidth || y == kWidth;
        const bool border = !outside && (x == 0 || y == 0 || x == kWidth - 1 || y == kWidth - 1);
        const float level = outside || (!border && random.uniform() < 0.5) ? kWhite : kBlack;
        float in_light = 0;
        constexpr int kSamples = 10;
        for (int i = 0; i < kSamples * kSamples; ++i) {
          const double u = x + (i % kSamples + 0.5) / kSamples;
          const double v = y + (i / kSamples + 0.5) / kSamples;  // NOLINT(bugprone-integer-division)
          in_light += std::cos(angle) * u + std::sin(angle) * v > offset ? 1.0F : 0.0F;
        }
        in_light /= kSamples * kSamples;
        lit.push_back(level);
        share.push_back(in_light);
        seen.push_back(level * (in_light + (1 - in_light) * light_in_shadow) +
                       static_cast<float>(random.normal()));
      }
    }
  }
  [[nodiscard]] CellLevels cells() const { return {seen, kWidth, 1}; }
};

TEST(ShadowEdge, CorrectedLevelsMatchTheLitOnesOnBothSides) {
  Random random(31);
  int undecided = 0;
  int cells = 0;
  for (int round = 0; round < 60; ++round) {
    const double angle = random.uniform(0, 6.283);
    const double middle = (std::cos(angle) + std::sin(angle)) * kWidth / 2;
    const Shaded tag(random, angle, middle + random.uniform(-2.5, 2.5), 0.35F);
    const auto edge = find_shadow_edge(tag.cells(), 10);
    ASSERT_TRUE(edge) << round;
    for (int y = 0; y < kWidth; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const std::size_t at = static_cast<std::size_t>((y + 1) * kSide + x + 1);
        const float level = edge->level_if_lit(tag.seen[at], x, y);
        const bool white = level > 0.5F * (edge->border[1] + edge->around[1]);
        ++cells;
        undecided += white != (tag.lit[at] == kWhite) ? 1 : 0;
      }
    }
    EXPECT_NEAR(edge->around[1], kWhite, 12) << round;
    EXPECT_NEAR(edge->around[0], 0.35 * kWhite, 12) << round;
    EXPECT_NEAR(edge->border[1], kBlack, 6) << round;
  }
  EXPECT_LT(undecided, cells / 100) << "only cells that the edge crosses; seed 31";
}

TEST(ShadowEdge, IsNotFoundInEvenIllumination) {
  Random random(32);
  for (int round = 0; round < 60; ++round) {
    const Shaded tag(random, 0, -100, 0.35F);
    EXPECT_FALSE(find_shadow_edge(tag.cells(), 10)) << round;
  }
}

TEST(ShadowEdge, IsNotFoundWithoutContrast) {
  Random random(33);
  const Shaded tag(random, 0, 4, 0.02F);  // in the shadow, black and white differ by 3 grey levels
  EXPECT_FALSE(find_shadow_edge(tag.cells(), 10));
}

}  // namespace
}  // namespace waymark::search

namespace waymark {
namespace {

// Tests the evidence that cell levels provide for a code, and the reading of known tags.

constexpr std::uint64_t kSeed = 20261128;
using search::evidence_bits;
using testing::paint_cells;
using testing::paint_tag;
using testing::square_corners;

/// Cells 0 to n - 1 hold the bits.
std::vector<std::uint16_t> cells_of(std::size_t count) {
  std::vector<std::uint16_t> cells(count);
  std::iota(cells.begin(), cells.end(), std::uint16_t{0});
  return cells;
}

TEST(Evidence, GrowsWithCertainBitsAndShrinksWithWrongOnes) {
  const auto cells = cells_of(36);
  const std::vector<float> sure(36, 50);
  const float all = evidence_bits(sure, cells, 0);
  EXPECT_GT(all, 30);
  EXPECT_LE(all, 36);
  EXPECT_LT(evidence_bits(sure, cells, 1), all - 4) << "a certain but wrong bit";
  std::vector<float> undecided = sure;
  undecided[35] = 2;  // the least significant bit
  EXPECT_GT(evidence_bits(undecided, cells, 1), evidence_bits(sure, cells, 1) + 2)
      << "a nearly undecided bit";
  EXPECT_EQ(evidence_bits(std::vector<float>(36, 0), cells, 0), 0);
  std::vector<float> half = sure;
  for (float& level : half) level *= 0.01F;
  EXPECT_NEAR(evidence_bits(half, cells, 0), all, 1e-3) << "independent of the contrast";
}

/// The threshold for known tags relies on this: for random bits, the likelihood ratio has a mean of 1, so t
/// bits are reached with a probability of at most 2^-t.
TEST(Evidence, RandomBitsSatisfyMarkovsBound) {
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

/// An image of tag 7 in which some bits are grey, slightly on the wrong side of the threshold.
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
    EXPECT_TRUE(others->detect(image).value().empty()) << count << ": tag 7 is not a known tag";
    const auto found = known->detect(image).value();
    ASSERT_EQ(found.size(), 1U) << count;
    EXPECT_EQ(found[0].tag.number, 7);
    EXPECT_EQ(found[0].hamming, static_cast<int>(count));
  }
  EXPECT_TRUE(known->detect(with_grey_bits(7)).value().empty()) << "too many wrong bits";
}

TEST(KnownTags, NumbersOutsideTheFamilyAreIgnored) {
  EXPECT_TRUE(make_waymark_detector(knowing({-1, 587, 1'000'000})));
}

// Tests tags in a hard shadow or under a bar, which cannot be decoded with a single threshold.

using testing::add_noise;
using testing::max_corner_error_px;
using testing::TagCorners;

std::unique_ptr<Detector> uncorrected() {
  DetectorOptions options;
  options.max_hamming = 0;
  return make_waymark_detector(options).value();
}

TagCorners in_the_middle(double side_px, double angle_rad) {
  return square_corners({100.3, 99.6}, side_px, angle_rad);
}

TEST(HiddenBits, ReadsTagsInAHardShadow) {
  const auto detector = uncorrected();
  Random random(17);
  int found_count = 0;
  for (int round = 0; round < 40; ++round) {
    const TagId tag{FamilyId::Tag36h11, round};
    const double angle = random.uniform(0, 2 * std::numbers::pi);
    const double offset = random.uniform(-15, 15);
    Image image(200, 200, 170);
    paint_tag(image, tag, in_the_middle(60, random.uniform(0, 6)), 30, 210);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const bool dark = std::cos(angle) * (x - 100) + std::sin(angle) * (y - 100) < offset;
        if (dark) image.row(y)[x] = static_cast<std::uint8_t>(image.row(y)[x] * 2 / 5);
      }
    }
    add_noise(image, 2, random);
    const auto found = detector->detect(image).value();
    for (const TagDetection& one : found) EXPECT_EQ(one.tag, tag) << round;
    found_count += static_cast<int>(found.size());
  }
  EXPECT_GE(found_count, 38) << "seed 17";
}

TEST(HiddenBits, ReadsTagsWithABarOverTheBorderAndSomeBits) {
  const auto detector = uncorrected();
  Random random(18);
  int found_count = 0;
  for (int round = 0; round < 40; ++round) {
    const TagId tag{FamilyId::Tag36h11, round};
    const TagCorners truth = in_the_middle(64, 0);
    Image image(200, 200, 140);
    paint_tag(image, tag, truth);
    // A bright bar, 1.7 cells wide, on the left side also covers the centres of six bits.
    const int left = static_cast<int>(truth[0].x());
    for (int y = 0; y < image.height(); ++y)
      for (int x = left - 3; x < left + 14; ++x) image.row(y)[x] = 170;
    add_noise(image, 2, random);
    const auto found = detector->detect(image).value();
    for (const TagDetection& one : found) EXPECT_EQ(one.tag, tag) << round;
    found_count += static_cast<int>(found.size());
    for (const TagDetection& one : found) EXPECT_LT(max_corner_error_px(one.corners_px, truth), 2) << round;
  }
  EXPECT_GE(found_count, 36) << "seed 18";
}

}  // namespace
}  // namespace waymark
