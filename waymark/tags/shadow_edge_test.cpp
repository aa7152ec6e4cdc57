#include "waymark/tags/shadow_edge.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark::search {
namespace {

constexpr int kWidth = 8;
constexpr int kSide = kWidth + 2;
constexpr float kBlack = 40;
constexpr float kWhite = 200;

/// A tag's cells with random bits, in the light, and darkened where normal . place is less than the offset.
struct Shaded {
  std::vector<float> lit;
  std::vector<float> seen;
  std::vector<float> share;  ///< of a cell in the light, by sub-samples

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

TEST(ShadowEdge, LevelsAreThoseInTheLightOnBothSidesOfIt) {
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
        const float level = edge->in_the_light(tag.seen[at], x, y);
        const bool white = level > 0.5F * (edge->border[1] + edge->around[1]);
        ++cells;
        undecided += white != (tag.lit[at] == kWhite) ? 1 : 0;
      }
    }
    EXPECT_NEAR(edge->around[1], kWhite, 12) << round;
    EXPECT_NEAR(edge->around[0], 0.35 * kWhite, 12) << round;
    EXPECT_NEAR(edge->border[1], kBlack, 6) << round;
  }
  EXPECT_LT(undecided, cells / 100) << "cells that the edge crosses, seed 31";
}

TEST(ShadowEdge, ThereIsNoneInEvenLight) {
  Random random(32);
  for (int round = 0; round < 60; ++round) {
    const Shaded tag(random, 0, -100, 0.35F);
    EXPECT_FALSE(find_shadow_edge(tag.cells(), 10)) << round;
  }
}

TEST(ShadowEdge, ThereIsNoneWhereBlackIsAsWhite) {
  Random random(33);
  const Shaded tag(random, 0, 4, 0.02F);  // black: white of the shadow less its black is 3 grey levels
  EXPECT_FALSE(find_shadow_edge(tag.cells(), 10));
}

}  // namespace
}  // namespace waymark::search
