#include "waymark/tags/pattern_fit.hpp"

#include <cmath>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/facing_tag.hpp"
#include "waymark/tags/lanes.hpp"
#include "waymark/tags/tag_fit.hpp"

namespace waymark::refinement {
namespace {

using waymark::testing::detection_at;
using waymark::testing::Print;
using waymark::testing::render;

TEST(NormalLanes, AreTheNormalDistribution) {
  for (double z = -8; z <= 8; z += 0.013) {
    const NormalLanes<Lanes> found = normal_lanes<Lanes>(Lanes::Constant(static_cast<float>(z)));
    EXPECT_NEAR(static_cast<double>(found.cdf[3]), 0.5 * std::erfc(-z / std::sqrt(2.0)), 3e-5);
    EXPECT_NEAR(static_cast<double>(found.pdf[5]), std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi),
                3e-5);
  }
}

TEST(Pattern, IsWhatIsPrinted) {
  for (const FamilyId id : kAllFamilies) {
    const Family& table = family(id);
    const int ring = (table.total_width - table.width_at_border) / 2;
    for (const int number : {0, 5, static_cast<int>(table.codes.size()) - 1}) {
      const auto printed = bitmap({id, number});
      const Pattern pattern = tag_pattern({id, number});
      ASSERT_EQ(pattern.cells, table.width_at_border);
      for (int y = -ring; y < table.width_at_border + ring; ++y) {
        for (int x = -ring; x < table.width_at_border + ring; ++x) {
          const int level = printed[static_cast<std::size_t>((y + ring) * table.total_width + x + ring)];
          if (level == 128 || !pattern.known_at(x, y)) continue;
          EXPECT_EQ(pattern.white_at(x, y), level == 255 ? 1.0F : 0.0F)
              << table.name << " " << number << " " << x << " " << y;
        }
      }
    }
  }
}

/// A tag read where it is, with the parameters it was drawn with.
std::unique_ptr<TagFit> fit_of(const Print& print) {
  auto fit = std::make_unique<TagFit>();
  Random random(1);
  start_fit(detection_at(print, 0, random), {}, nullptr, *fit);
  const Quad corners = corners_of(*fit);
  EXPECT_TRUE(read_tag(render(print), {}, corners, *fit));
  fit->state.x[kLogBlur] = 0.5 * std::log(print.lens_px * print.lens_px + 1.0 / 12);
  fit->state.x[kBlackPlane] = print.black;
  fit->state.x[kStepPlane] = print.white - print.black;
  for (int k = 0; k < 4; ++k)
    fit->state.x[kRim + k] = (print.behind - print.white) / (print.white - print.black);
  return fit;
}

TagEquations equations(TagFit& fit, SumPatch sum_patch = quickest_sum_patch()) {
  measure_patches(fit.pattern, fit.pixels, fit.state, sum_patch);
  return equations_of(fit.pattern, fit.pixels, true, fit.state);
}

TEST(PatternModel, IsWhatATagLooksLike) {
  for (const double side_px : {13.0, 20.0, 32.0, 64.0}) {
    Print print;
    print.side_px = side_px;
    const auto fit = fit_of(print);
    const TagEquations found = equations(*fit);
    // 160 grey levels of contrast; rounding alone leaves 0.3.
    EXPECT_LT(std::sqrt(found.cost / found.pixels), side_px < 16 ? 1.2 : 0.8) << side_px;
    EXPECT_EQ(found.pixels, fit->pixels.pixels);
  }
}

TEST(PatternModel, GradientIsThatOfTheCost) {
  for (const double side_px : {14.0, 24.0, 64.0}) {
    for (const double white : {200.0, 300.0}) {
      Print print;
      print.side_px = side_px;
      print.white = white;
      print.noise = 2;
      const auto fit = fit_of(print);
      EXPECT_EQ(fit->pixels.clipped, white > 255);
      TagVector h;
      h << 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1, 1, 1, 1, 1, 1, 0.02, 0.02, 0.02, 0.02, 0.05,
          0.05, 0.05, 0.05, 0.2;
      TagVector& x = fit->state.x;
      x += 1.5 * h;
      const TagVector at = x;
      const TagEquations found = equations(*fit);
      for (int i = 0; i < kTagParameters; ++i) {
        x = at;
        x[i] += h[i];
        const double up = equations(*fit).cost;
        x[i] -= 2 * h[i];
        const double slope = (up - equations(*fit).cost) / (2 * h[i]);
        // Places within a patch are taken as its middle's.
        EXPECT_NEAR(-2 * found.gradient[i], slope,
                    0.12 * std::sqrt(found.information(i, i) * found.cost) + 1e-3 * std::abs(slope))
            << "parameter " << i << " of a tag of " << side_px << " px";
      }
    }
  }
}

/// Where the processor has AVX2 the two are different code; elsewhere one.
TEST(SumPatch, TheQuickestAgreesWithThePortableOne) {
  for (const double white : {200.0, 255.0}) {  // clipped too
    for (const double side_px : {14.0, 24.0, 70.0}) {
      const Print print{.side_px = side_px, .white = white, .noise = 2};
      const auto fit = fit_of(print);
      fit->state.x[kTagGrowth] = 0.3;
      fit->state.x[kStretch] = 0.2;
      const TagEquations portable = equations(*fit, sum_patch_portable);
      const TagEquations quick = equations(*fit);
      for (int i = 0; i < kTagParameters; ++i) {
        for (int k = 0; k < kTagParameters; ++k) {
          // Off the diagonal terms of both signs cancel.
          const double scale = std::sqrt(portable.information(i, i) * portable.information(k, k));
          EXPECT_NEAR(quick.information(i, k), portable.information(i, k), 5e-5 * scale) << i << " " << k;
        }
        EXPECT_NEAR(quick.gradient[i], portable.gradient[i],
                    5e-5 * std::sqrt(portable.information(i, i) * portable.cost))
            << i;
      }
      EXPECT_NEAR(quick.cost, portable.cost, 5e-5 * portable.cost);
      EXPECT_EQ(portable.pixels, quick.pixels);
    }
  }
}

}  // namespace
}  // namespace waymark::refinement
