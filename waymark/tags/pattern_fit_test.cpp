#include "waymark/tags/pattern_fit.hpp"

#include <cmath>
#include <memory>
#include <numbers>
#include <set>

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
  EXPECT_TRUE(read_tag(render(print), corners_of(*fit), *fit));
  TagVector& x = fit->pattern.x;
  x[kLogBlur] = 0.5 * std::log(print.lens_px * print.lens_px + 1.0 / 12);
  x[kBlackPlane] = print.black;
  x[kStepPlane] = print.white - print.black;
  for (int k = 0; k < 4; ++k) x[kRim + k] = (print.behind - print.white) / (print.white - print.black);
  return fit;
}

/// An edge along the columns is known as well as its slope is seen: every column at it must be read
/// somewhere.
TEST(PatternPixels, ReadAllColumnsAtAnUprightEdge) {
  for (const double side_px : {50.0, 75.0, 85.0, 100.0, 120.0}) {
    Print print;
    print.side_px = side_px;
    print.roll_rad = 0;
    print.image_px = static_cast<int>(side_px) + 50;
    print.center_px = {0.5 * print.image_px + 0.3, 0.5 * print.image_px};
    const auto fit = fit_of(print);
    const double edge_px = print.center_px.x() + side_px / 2;
    std::set<int> columns;
    for (const PixelBlock& block : fit->pattern.pixels.used()) {
      for (int i = 0; i < kBlockPixels; ++i) {
        const double x =
            fit->pattern.pixels.middle_px.x() + fit->pattern.pixels.unit_px * static_cast<double>(block.x[i]);
        if (block.weight[i] > 0 && std::abs(x - edge_px) < 2) columns.insert(static_cast<int>(std::floor(x)));
      }
    }
    EXPECT_EQ(columns.size(), 4U) << side_px;
  }
}

TEST(PatternModel, IsWhatATagLooksLike) {
  for (const double side_px : {13.0, 20.0, 32.0, 64.0}) {
    Print print;
    print.side_px = side_px;
    const auto fit = fit_of(print);
    measure(false, fit->pattern);
    const PatternSums& found = fit->pattern.sums;
    // 160 grey levels of contrast; rounding alone leaves 0.3.
    EXPECT_LT(std::sqrt(found.cost / found.pixels), side_px < 16 ? 1.2F : 0.8F) << side_px;
    EXPECT_EQ(found.pixels, static_cast<float>(fit->pattern.pixels.pixels));
  }
}

/// Half the derivative of the cost by each parameter and the scale of its doubt.
struct Slopes {
  TagVector gradient, scale;
};

Slopes slopes_of(PatternFit& fit, SumPattern sum_pattern = quickest_sum_pattern()) {
  // No priors and a noise of 1: the least squares alone.
  fit.priors = {};
  measure(true, fit, sum_pattern);
  set_information(fit);
  Slopes slopes;
  slopes.gradient = gradient_of(fit) * fit.noise_variance;
  slopes.scale = (fit.information.diagonal() * fit.noise_variance).cwiseSqrt();
  return slopes;
}

TEST(PatternModel, GradientIsThatOfTheCost) {
  for (const double side_px : {14.0, 24.0, 64.0}) {
    for (const double white : {200.0, 300.0}) {
      Print print;
      print.side_px = side_px;
      print.white = white;
      print.noise = 2;
      const auto fit = fit_of(print);
      PatternFit& pattern = fit->pattern;
      EXPECT_EQ(pattern.pixels.clipped, white > 255);
      TagVector h;
      h << 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1, 1, 1, 1, 1, 1, 0.02, 0.02, 0.02, 0.02, 0.02,
          2e-3, 2e-3, 2e-3, 2e-3, 0.05, 0.05, 0.05, 0.05;
      pattern.x += 1.5 * h;
      const TagVector at = pattern.x;
      measure(true, pattern);
      TagVector gradient = TagVector::Zero();
      TagVector scale = TagVector::Zero();
      for (int i = 0; i < kShared; ++i) {
        gradient[i] = static_cast<double>(pattern.sums.gradient[i]);
        scale[i] = std::sqrt(static_cast<double>(pattern.sums.information[i][i] * pattern.sums.cost));
      }
      for (const PixelBlock& block : pattern.pixels.used()) {
        const auto b = static_cast<std::size_t>(&block - pattern.pixels.block.data());
        for (int lane = 0; lane < kLanes; ++lane) {
          if (block.side[lane] < 0) continue;
          const int i = kRim + block.side[lane];
          gradient[i] += static_cast<double>(pattern.blocks[b].gradient[kShared][lane]);
          scale[i] += static_cast<double>(pattern.blocks[b].rim[kShared][lane]);
        }
      }
      for (int i = kRim; i < kTagParameters; ++i)
        scale[i] = std::sqrt(scale[i] * static_cast<double>(pattern.sums.cost));
      for (int i = 0; i < kTagParameters; ++i) {
        pattern.x = at;
        pattern.x[i] += h[i];
        measure(false, pattern);
        const auto up = static_cast<double>(pattern.sums.cost);
        pattern.x[i] -= 2 * h[i];
        measure(false, pattern);
        const double slope = (up - static_cast<double>(pattern.sums.cost)) / (2 * h[i]);
        // Pixels leave the cost when the model leaves the scale; and the blur of small tags, counted in
        // cells, changes with the homography, which is left out.
        const double inexact = white > 255 ? 0.15 : side_px < 20 ? 0.08 : 0.03;
        EXPECT_NEAR(-2 * gradient[i], slope, inexact * scale[i] + 0.03 * std::abs(slope))
            << "parameter " << i << " of a tag of " << side_px << " px";
      }
    }
  }
}

/// Where the processor has AVX2 the two are different code; elsewhere one.
TEST(SumPattern, TheQuickestAgreesWithThePortableOne) {
  for (const double white : {200.0, 255.0}) {  // clipped too
    for (const double side_px : {14.0, 24.0, 70.0}) {
      const Print print{.side_px = side_px, .white = white, .noise = 2};
      const auto fit = fit_of(print);
      fit->pattern.x[kGrowth] = 0.3;
      fit->pattern.x[kStretch] = 0.2;
      fit->pattern.x[kHalo] = 0.2;
      const Slopes quick = slopes_of(fit->pattern);
      const TagMatrix information = fit->pattern.information * fit->pattern.noise_variance;
      const PatternSums quick_sums = fit->pattern.sums;
      const Slopes portable = slopes_of(fit->pattern, sum_pattern_portable);
      const TagMatrix expected = fit->pattern.information * fit->pattern.noise_variance;
      const auto cost = static_cast<double>(fit->pattern.sums.cost);
      for (int i = 0; i < kTagParameters; ++i) {
        // Off the diagonal terms of both signs cancel.
        for (int k = 0; k < kTagParameters; ++k)
          EXPECT_NEAR(information(i, k), expected(i, k), 5e-5 * portable.scale[i] * portable.scale[k])
              << i << " " << k;
        EXPECT_NEAR(quick.gradient[i], portable.gradient[i], 5e-5 * portable.scale[i] * std::sqrt(cost)) << i;
      }
      EXPECT_NEAR(static_cast<double>(quick_sums.cost), cost, 5e-5 * cost);
      EXPECT_EQ(quick_sums.pixels, fit->pattern.sums.pixels);
    }
  }
}

}  // namespace
}  // namespace waymark::refinement
