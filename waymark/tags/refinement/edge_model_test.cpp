#include "waymark/tags/refinement/edge_model.hpp"

#include <cmath>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/facing_tag.hpp"
#include "tests/support/same_sums.hpp"

namespace waymark::refinement {
namespace {

using waymark::testing::corners_of;
using waymark::testing::Print;
using waymark::testing::render;

TEST(NormalLanes, AreTheNormalDistribution) {
  for (double z = -8; z <= 8; z += 0.013) {
    const NormalLanes<Lanes> found = normal_lanes<Lanes>(Lanes::Constant(static_cast<float>(z)));
    EXPECT_NEAR(static_cast<double>(found.cdf[3]), 0.5 * std::erfc(-z / std::sqrt(2.0)), 3e-5);
    EXPECT_NEAR(static_cast<double>(found.pdf[5]), std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi),
                3e-5);
    EXPECT_NEAR(static_cast<double>(bell_cdf<Lanes>(Lanes::Constant(static_cast<float>(z)))[0]),
                0.5 * std::erfc(-z / std::sqrt(2.0)), 1.2e-2);
  }
  EXPECT_EQ(bell_cdf<Lanes>(Lanes::Constant(-9.0F))[0], 0.0F);
  EXPECT_EQ(bell_cdf<Lanes>(Lanes::Constant(9.0F))[0], 1.0F);
}

std::unique_ptr<Band> band_of(const Print& print, const BandLimits& limits, int k) {
  const auto edges = edge_frames(corners_of(print), family(print.tag.family).width_at_border);
  auto band = std::make_unique<Band>();
  read_band(render(print), edges.at(static_cast<std::size_t>(k)),
            tag_surroundings(print.tag).at(static_cast<std::size_t>(k)), limits, 0.7, *band);
  return band;
}

EdgeVector truth_of(const Print& print) {
  EdgeVector x;
  x << 0, 0, 0, print.behind - print.white, print.black, print.white - print.black,
      0.5 * std::log(print.lens_px * print.lens_px + 1.0 / 12);
  return x;
}

/// Root mean square residual of the model at the true parameters.
double residual(const Print& print, const BandLimits& limits) {
  double cost = 0;
  double pixels = 0;
  for (int k = 0; k < 4; ++k) {
    const auto band = band_of(print, limits, k);
    SliceCosts costs;
    const NormalEquations normal = linearize(*band, truth_of(print), 0.0, costs);
    EXPECT_EQ(normal.pixels(), band->pixels);
    cost += normal.cost;
    pixels += normal.pixels();
  }
  return std::sqrt(cost / pixels);
}

TEST(EdgeModel, MatchesARenderedTag) {
  Print large;
  large.side_px = 64;
  EXPECT_LT(residual(large, {.inside_px = 3, .outside_px = 3, .corner_margin_px = 2, .cells_matter = false}),
            0.6);
  Print small;
  small.side_px = 20;
  // The contrast is 160 grey levels; rounding alone results in 0.3.
  EXPECT_LT(
      residual(small, {.inside_px = 2, .outside_px = 2.5, .corner_margin_px = 1.4, .cells_matter = true}),
      1.5);
  EXPECT_GT(
      residual(small, {.inside_px = 2, .outside_px = 2.5, .corner_margin_px = 1.4, .cells_matter = false}),
      5);
}

TEST(EdgeModel, GradientMatchesTheCost) {
  for (const bool cells_matter : {false, true}) {
    for (const double white : {200.0, 300.0}) {
      Print print;
      print.side_px = cells_matter ? 22 : 64;
      print.white = white;
      print.noise = 2;
      const auto band = band_of(print, {2, 2.5, 1.4, cells_matter}, 1);
      EXPECT_EQ(band->clipped, white > 255);
      EdgeVector x = truth_of(print);
      x += (EdgeVector() << 0.1, -0.05, 0.02, 3, 2, -4, 0.05).finished();
      SliceCosts costs;
      const NormalEquations normal = linearize(*band, x, 0.0, costs);
      const EdgeVector h = (EdgeVector() << 0.02, 0.02, 0.02, 2, 1, 1, 0.02).finished();
      for (int i = 0; i < kParameters; ++i) {
        if (i == kBeyond && !cells_matter) continue;
        EdgeVector up = x;
        EdgeVector down = x;
        up[i] += h[i];
        down[i] -= h[i];
        const double slope =
            (linearize(*band, up, 0.0, costs).cost - linearize(*band, down, 0.0, costs).cost) / (2 * h[i]);
        const double scale = std::sqrt(normal.information(i, i) * normal.cost);
        EXPECT_NEAR(-2 * normal.gradient[i], slope, 0.05 * scale)
            << "parameter " << i << " cells " << cells_matter;
      }
    }
  }
}

TEST(Surroundings, MatchThePrint) {
  for (const FamilyId id : kAllFamilies) {
    const Family& table = family(id);
    const int cells = table.width_at_border;
    const int ring = (table.total_width - cells) / 2;
    for (const int number : {0, 5, static_cast<int>(table.codes.size()) - 1}) {
      const auto printed = bitmap({id, number});
      const auto edges = tag_surroundings({id, number});
      for (int k = 0; k < 4; ++k) {
        const Surroundings& edge = edges.at(static_cast<std::size_t>(k));
        ASSERT_EQ(edge.cells, cells);
        for (int place = 0; place < cells; ++place) {
          const auto share =
              [&](int row) {  // share of the colour outside the border, as printed; -1 beyond the print
                const int x[] = {place, cells - 1 - row, cells - 1 - place, row};
                const int y[] = {row, place, cells - 1 - row, cells - 1 - place};
                if (-row > ring) return -1;
                const int level =
                    printed[static_cast<std::size_t>((y[k] + ring) * table.total_width + x[k] + ring)];
                return level == 128 ? -1 : (level == 255) != table.reversed_border ? 1 : 0;
              };
          const auto at = static_cast<std::size_t>(place);
          if (place > 0 && place < cells - 1) {
            EXPECT_EQ(edge.behind.at(at), static_cast<float>(share(1))) << table.name << " " << number;
          }
          if (edge.beyond_known) {
            EXPECT_EQ(edge.beyond.at(at), static_cast<float>(share(-2))) << table.name << " " << number;
          }
        }
      }
    }
  }
  EXPECT_FALSE(tag_surroundings({FamilyId::Tag36h11, 0})[0].beyond_known);
  EXPECT_TRUE(tag_surroundings({FamilyId::TagStandard41h12, 0})[0].beyond_known);
}

/// On processors with AVX2 these are different implementations; elsewhere they are the same.
TEST(SumEdge, TheFastestAgreesWithThePortableVersion) {
  for (const double white : {200.0, 255.0}) {  // the second value causes saturation
    for (const bool cells_matter : {false, true}) {
      const Print print{.side_px = cells_matter ? 24.0 : 70.0, .white = white, .noise = 2};
      const auto band = band_of(
          print, {.inside_px = 2, .outside_px = 2, .corner_margin_px = 1.5, .cells_matter = cells_matter}, 0);
      EdgeVector x = truth_of(print);
      x[kFrom] += 0.1;
      x[kLogBlur] += 0.1;
      SliceCosts portable_costs;
      SliceCosts quick_costs;
      const NormalEquations portable = linearize(*band, x, 0.1, portable_costs, sum_edge_portable);
      const NormalEquations quick = linearize(*band, x, 0.1, quick_costs);
      testing::expect_same_sums(quick, portable, kParameters);
      EXPECT_EQ(portable.pixels(), quick.pixels());
    }
  }
}

}  // namespace
}  // namespace waymark::refinement
