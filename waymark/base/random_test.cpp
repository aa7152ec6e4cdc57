#include "waymark/base/random.hpp"

#include <array>
#include <cmath>
#include <cstddef>

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(Random, TheSameSeedGivesTheSameNumbersOnAllPlatforms) {
  Random random(1);
  // The first two draws of mt19937_64 with seed 1, as fixed by the standard.
  EXPECT_DOUBLE_EQ(random.uniform(), static_cast<double>(2469588189546311528ULL >> 11) * 0x1.0p-53);
  EXPECT_DOUBLE_EQ(random.uniform(), static_cast<double>(2516265689700432462ULL >> 11) * 0x1.0p-53);
}

TEST(Random, NormalHasTheMomentsOfTheNormal) {
  Random random(2);
  constexpr int kDraws = 200000;
  std::array<double, 5> moments{};
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.normal();
    for (std::size_t k = 1; k < moments.size(); ++k)
      moments.at(k) += std::pow(x, static_cast<double>(k)) / kDraws;
  }
  EXPECT_NEAR(moments[1], 0.0, 4 * std::sqrt(1.0 / kDraws));
  EXPECT_NEAR(moments[2], 1.0, 4 * std::sqrt(2.0 / kDraws));
  EXPECT_NEAR(moments[3], 0.0, 4 * std::sqrt(15.0 / kDraws));
  EXPECT_NEAR(moments[4], 3.0, 4 * std::sqrt(96.0 / kDraws));
}

TEST(Random, IndexIsUniform) {
  Random random(3);
  std::array<int, 7> counts{};
  constexpr int kDraws = 70000;
  for (int i = 0; i < kDraws; ++i) ++counts.at(random.index(7));
  for (const int count : counts) EXPECT_NEAR(count, kDraws / 7, 4 * std::sqrt(kDraws / 7.0));
}

TEST(Random, ForksAreIndependentOfLaterDraws) {
  Random a(4);
  Random b(4);
  Random fork_a = a.fork();
  Random fork_b = b.fork();
  for (int i = 0; i < 10; ++i) (void)a.normal();
  EXPECT_EQ(fork_a.uniform(), fork_b.uniform());
}

}  // namespace
}  // namespace waymark
