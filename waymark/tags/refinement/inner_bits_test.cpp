#include "waymark/tags/refinement/inner_bits.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "tests/support/facing_tag.hpp"
#include "tests/support/same_sums.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark {
namespace {

using testing::corners_of;
using testing::detection_at;
using testing::Print;
using testing::render;
using testing::worst_error;

/// Changes each grey level to `of(level, x, y)`, limited to [0, 255].
template <class Change>
void change(Image& image, const Change& of) {
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      std::uint8_t& pixel = image.row(y)[x];
      pixel = static_cast<std::uint8_t>(std::clamp(std::lround(of(pixel, x, y)), 0L, 255L));
    }
  }
}

double encoded(double level) { return 255 * std::pow(level / 255, 1 / 2.2); }

Print print_of(FamilyId id) {
  Print print;
  print.tag = {id, 3};
  print.roll_rad = 0.2;
  print.side_px = 6.5 * family(id).width_at_border;
  print.black = 20;
  print.noise = 1;
  return print;
}

/// Without the correction, the corners would be 0.35 px too far inside.
TEST(InnerCorrection, UndoesGammaInEveryFamily) {
  Random random(4);
  for (const FamilyId id : kAllFamilies) {
    if (id == FamilyId::TagCustom48h12)
      continue;  // its middle is free, so no bit has neighbours with known colours
    const Print print = print_of(id);
    Image image = render(print);
    change(image, [](double level, int, int) { return encoded(level); });
    const auto result = refine_corners(image, detection_at(print, 0.1, random));
    ASSERT_TRUE(result.refined()) << to_string(id) << " " << to_string(result.outcome);
    EXPECT_LT(worst_error(result.corners_px, print), 0.07) << to_string(id);
    EXPECT_LT(testing::nees(result.corners_px, result.covariance_px2, print), 24)
        << to_string(id);  // the expected value is 8
  }
}

TEST(InnerCorrection, UndoesAddedIllumination) {
  Random random(5);
  for (const FamilyId id : {FamilyId::Tag36h11, FamilyId::Tag25h9}) {
    for (const double roll_rad : {0.2, 1.8, 3.3, 5.0}) {
      Print print = print_of(id);
      print.roll_rad = roll_rad;
      Image image = render(print);
      const double per_px = 20 / print.side_px;
      change(image, [&](double level, int x, int) { return level + per_px * (x - print.center_px.x()); });
      const auto result = refine_corners(image, detection_at(print, 0.1, random));
      ASSERT_TRUE(result.refined()) << to_string(id) << " " << to_string(result.outcome);
      EXPECT_LT(worst_error(result.corners_px, print), 0.05) << to_string(id) << " " << roll_rad;
    }
  }
}

using refinement::InnerPixels;
using refinement::InnerSums;
using refinement::InnerVector;
using refinement::kBendT;
using refinement::kBlack;
using refinement::kBlackS;
using refinement::kBlurS;
using refinement::kBlurT;
using refinement::kGrowth;
using refinement::kInnerUnknowns;
using refinement::kShearS;
using refinement::kShiftS;
using refinement::kStretchT;
using refinement::kUnknownsOnBorder;
using refinement::kWhite;
using refinement::kWhiteS;
using refinement::kWhiteT;
using refinement::sum_up;

/// Pixels of a tag of this size, with cells placed by its true corners.
InnerPixels pixels_of(const Print& print) {
  refinement::TagBands tag;
  tag.edges = refinement::edge_frames(corners_of(print), family(print.tag.family).width_at_border);
  refinement::TagEstimate estimate;
  for (auto& edge : estimate.edges) edge.setZero();
  InnerPixels pixels;
  refinement::read_inner_pixels(render(print), {print.tag}, tag, estimate, InnerPixels::kCorrectionPixels,
                                pixels);
  return pixels;
}

/// A point near the truth, with all unknowns different from 0.
InnerVector point_near(const Print& print, double growth) {
  InnerVector x;
  for (int i = 0; i < kInnerUnknowns; ++i) x[i] = 0.01 * (i % 3 - 1) + 0.02;
  x[kBlack] = print.black;
  x[kWhite] = print.white - print.black;
  x[kBlackS] = 2;
  x[kWhiteT] = -3;
  x[kGrowth] = growth;
  x[kBlurS] = x[kBlurT] = std::log(0.7);
  return x;
}

template <int Unknowns>
void expect_same_sums(const InnerPixels& pixels, const InnerVector& x) {
  const auto portable = sum_up<Unknowns>(pixels, x, 1, 20, refinement::portable_inner_kernels());
  const auto quick = sum_up<Unknowns>(pixels, x, 1, 20);
  testing::expect_same_sums(quick, portable, Unknowns);
  EXPECT_NEAR(quick.pixels, portable.pixels, 2e-5 * portable.pixels);
}

/// On processors with AVX2 these are different implementations; elsewhere they are the same.
TEST(InnerSums, TheFastestAgreeWithThePortableOnes) {
  for (const double side_px : {20.0, 60.0}) {
    for (const double growth : {0.1, -0.8}) {  // the second value uses the exact model
      const Print print{.side_px = side_px, .noise = 2};
      InnerPixels pixels = pixels_of(print);
      ASSERT_GT(pixels.count, 100);
      for (const bool skew_matters : {false, true}) {
        pixels.skew_matters = skew_matters;
        expect_same_sums<kUnknownsOnBorder>(pixels, point_near(print, growth));
        expect_same_sums<kInnerUnknowns>(pixels, point_near(print, growth));
      }
    }
  }
}

/// The derivatives are those of the cost: half the change of the cost along an unknown is minus the gradient.
TEST(InnerSums, GradientIsTheDerivativeOfTheCost) {
  const Print print{.side_px = 60, .noise = 2};
  const InnerPixels pixels = pixels_of(print);
  const InnerVector x = point_near(print, 0.1);
  const InnerSums at = sum_up<kInnerUnknowns>(pixels, x, 1, 1e6);
  for (const int i : {int{kBlack}, int{kWhiteS}, int{kShiftS}, int{kStretchT}, int{kShearS}, int{kBendT}}) {
    InnerVector step = InnerVector::Zero();
    step[i] = 0.1 / std::sqrt(at.information(i, i));
    const double change = sum_up<kInnerUnknowns>(pixels, x + step, 1, 1e6).cost -
                          sum_up<kInnerUnknowns>(pixels, x - step, 1, 1e6).cost;
    EXPECT_NEAR(-0.25 * change / step[i], at.gradient[i], 0.02 * std::sqrt(at.information(i, i) * at.cost))
        << i;
  }
}

}  // namespace
}  // namespace waymark
