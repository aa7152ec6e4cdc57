#include "waymark/families/hamming.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

class HammingOf : public ::testing::TestWithParam<FamilyId> {};
INSTANTIATE_TEST_SUITE_P(All, HammingOf, ::testing::ValuesIn(kAllFamilies),
                         [](const auto& family_id) { return std::string(to_string(family_id.param)); });

std::uint64_t random_word(Random& random, std::size_t bits) { return random.index(std::uint64_t{1} << bits); }

TEST_P(HammingOf, FourQuarterTurnsAreTheIdentity) {
  const Family& table = family(GetParam());
  const CodeRotation rotation(table);
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const std::uint64_t code = random_word(random, table.bits.size());
    EXPECT_EQ(rotation.turned(code, 4), code);
    EXPECT_EQ(rotation.turned(code, -1), rotation.turned(code, 3));
    EXPECT_EQ(rotation.turned(rotation.turned(code, 1), 1), rotation.turned(code, 2));
    EXPECT_EQ(std::popcount(rotation.turned(code, 1)), std::popcount(code));
  }
}

TEST_P(HammingOf, TurningACodeTurnsItsPrint) {
  const Family& table = family(GetParam());
  const CodeRotation rotation(table);
  const int width = table.total_width;
  const int margin = (width - table.width_at_border) / 2;
  for (const int number : {0, 3, 29}) {
    const std::vector<std::uint8_t> cells = bitmap({GetParam(), number});
    // Rotates clockwise, so the left side becomes the top.
    const auto clockwise = [&](int x, int y) {
      const auto row = static_cast<std::size_t>(width - 1 - x);
      return cells.at(row * static_cast<std::size_t>(width) + static_cast<std::size_t>(y));
    };
    std::uint64_t read = 0;
    for (const BitCell& bit : table.bits) {
      read = read << 1U | (clockwise(bit.x + margin, bit.y + margin) == 255 ? 1U : 0U);
    }
    EXPECT_EQ(read, rotation.turned(table.codes.at(static_cast<std::size_t>(number)), 1));
  }
}

TEST_P(HammingOf, RotationalDistanceIsSymmetricAndInvariantToTurns) {
  const Family& table = family(GetParam());
  const CodeRotation rotation(table);
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const std::uint64_t a = random_word(random, table.bits.size());
    const std::uint64_t b = random_word(random, table.bits.size());
    const int distance = rotation.min_rotational_distance(a, b);
    EXPECT_EQ(rotation.min_rotational_distance(b, a), distance);
    EXPECT_EQ(rotation.min_rotational_distance(a, rotation.turned(b, i % 4)), distance);
    EXPECT_LE(distance, hamming_distance(a, b));
    EXPECT_EQ(rotation.min_rotational_distance(a, rotation.turned(a, i % 4)), 0);
  }
}

/// Evaluates the definition pair by pair.
int minimum_distance_of_all_pairs(const Family& table) {
  const CodeRotation rotation(table);
  int best = static_cast<int>(table.bits.size());
  for (std::size_t i = 0; i < table.codes.size(); ++i) {
    for (int turn = 1; turn < 4; ++turn) {
      best = std::min(best, hamming_distance(table.codes[i], rotation.turned(table.codes[i], turn)));
    }
    for (std::size_t j = 0; j < i; ++j) {
      best = std::min(best, rotation.min_rotational_distance(table.codes[i], table.codes[j]));
    }
  }
  return best;
}

TEST_P(HammingOf, MinimumDistanceEqualsThatOfAllPairs) {
  Family table = family(GetParam());
  table.codes.resize(std::min<std::size_t>(table.codes.size(), 600));
  EXPECT_EQ(minimum_distance(table), minimum_distance_of_all_pairs(table));
}

TEST(MinimumDistance, StopsSoonAfterCancellation) {
  int asked = 0;
  (void)minimum_distance(family(FamilyId::TagStandard52h13), [&] { return ++asked >= 3; });
  EXPECT_LE(asked, 4) << "polled once more at the next distance";
}

TEST(MinimumDistance, FindsAPlantedPairAtEveryDistance) {
  Random random(3);
  for (int planted = 0; planted <= 8; ++planted) {
    Family table = family(FamilyId::TagStandard41h12);
    table.codes.resize(300);
    std::uint64_t noise = 0;
    while (std::popcount(noise) < planted) noise |= std::uint64_t{1} << random.index(table.bits.size());
    table.codes.push_back(CodeRotation(table).turned(table.codes[random.index(300)], planted) ^ noise);
    EXPECT_EQ(minimum_distance(table), planted);
  }
}

TEST(MinimumDistance, DetectsACodeThatEqualsItsOwnTurn) {
  Family table = family(FamilyId::Tag36h11);
  table.codes.push_back(0);
  EXPECT_EQ(minimum_distance(table), 0);
}

TEST_P(HammingOf, MinimumDistanceIsAtLeastTheNominalOne) {
  EXPECT_EQ(minimum_distance(family(GetParam())), family(GetParam()).min_hamming);
}

}  // namespace
}  // namespace waymark
