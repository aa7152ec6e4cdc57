#include "waymark/tags/refinement/corner_refinement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/facing_tag.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

using testing::Corners;
using testing::corners_of;
using testing::detection_at;
using testing::Print;
using testing::render;
using testing::worst_error;

double nees(const RefinedCorners& found, const Print& print) {
  return testing::nees(found.corners_px, found.covariance_px2, print);
}

RefinementOptions straight() {
  RefinementOptions options;
  options.curvature_per_px = 0;
  return options;
}

// An inverted print exchanges the signs of all steps; a negative step is not a low contrast.
TEST(Refinement, FindsTheCornersOfInvertedPrints) {
  Random random(29);
  for (const FamilyId id : {FamilyId::Tag36h11, FamilyId::TagCustom48h12}) {
    Print print;
    print.tag = {id, 3};
    print.noise = 1.5;
    Print inverted = print;
    std::swap(inverted.black, inverted.white);
    inverted.behind = print.black + print.white - print.behind;
    const TagDetection start = detection_at(print, 0.3, random);
    const RefinedCorners usual = refine_corners(render(print), start);
    const RefinedCorners refined = refine_corners(render(inverted), start);
    ASSERT_EQ(refined.outcome, RefinementOutcome::Refined) << to_string(id);
    ASSERT_TRUE(usual.refined());
    EXPECT_LT(worst_error(refined.corners_px, print), 3 * worst_error(usual.corners_px, print) + 0.05);
    EXPECT_NEAR(refined.contrast, -usual.contrast, 0.1 * std::abs(usual.contrast));
  }
}

TEST(Refinement, FindsTheCornersOfCleanTagsOfAllSizes) {
  Random random(3);
  for (const double side_px : {14.0, 20.0, 28.0, 40.0, 64.0}) {
    for (int trial = 0; trial < 4; ++trial) {
      Print print;
      print.side_px = side_px;
      print.roll_rad = random.uniform(-3, 3);
      print.center_px += Eigen::Vector2d(random.uniform(), random.uniform());
      const auto result = refine_corners(render(print), detection_at(print, 0.15, random), straight());
      ASSERT_TRUE(result.refined()) << to_string(result.outcome);
      EXPECT_LT(worst_error(result.corners_px, print), side_px < 20 ? 0.03 : 0.01) << side_px;
      // The variance of the blur is that of the lens plus that of the pixel: 0.36 + 1/12.
      EXPECT_NEAR(result.blur_px, std::sqrt(0.36 + 1.0 / 12), 0.02);
      EXPECT_NEAR(result.contrast, 160, 8);
    }
  }
}

TEST(Refinement, FindsEveryFamily) {
  Random random(4);
  for (const FamilyId id : kAllFamilies) {
    Print print;
    print.tag = {id, 3};
    print.roll_rad = 0.2;
    print.side_px = 5.5 * family(id).width_at_border;
    const auto result = refine_corners(render(print), detection_at(print, 0.2, random), straight());
    ASSERT_TRUE(result.refined()) << to_string(id) << " " << to_string(result.outcome);
    EXPECT_LT(worst_error(result.corners_px, print), 0.015) << to_string(id);
    EXPECT_EQ(result.contrast < 0, family(id).reversed_border) << to_string(id);
  }
}

TEST(Refinement, EstimatesTheBlur) {
  Random random(5);
  for (const double lens_px : {0.3, 0.8, 1.2, 1.8}) {
    Print print;
    print.lens_px = lens_px;
    print.side_px = 64;
    const auto result = refine_corners(render(print), detection_at(print, 0.2, random), straight());
    ASSERT_TRUE(result.refined()) << lens_px;
    EXPECT_NEAR(result.blur_px, std::sqrt(lens_px * lens_px + 1.0 / 12), 0.05 * lens_px + 0.02);
    EXPECT_LT(worst_error(result.corners_px, print), 0.02) << lens_px;
  }
}

TEST(Refinement, CovarianceIsConsistentWithNoise) {
  double sum = 0;
  Eigen::Vector2d bias(0, 0);
  double outward = 0;
  constexpr int kTrials = 150;
  Random random(6);
  for (int trial = 0; trial < kTrials; ++trial) {
    Print print;
    print.image_px = 64;
    print.side_px = 32;
    print.noise = 3;
    print.roll_rad = random.uniform(-3, 3);
    print.center_px = {32 + random.uniform(), 32 + random.uniform()};
    const auto result = refine_corners(render(print, static_cast<std::uint64_t>(trial)),
                                       detection_at(print, 0.1, random), straight());
    ASSERT_TRUE(result.refined());
    EXPECT_NEAR(result.noise, 3, 0.5);
    sum += nees(result, print);
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d truth = corners_of(print)[k];
      bias += (result.corners_px[k] - truth) / (4.0 * kTrials);
      outward += (result.corners_px[k] - truth).dot((truth - print.center_px).normalized()) / (4.0 * kTrials);
    }
  }
  // There are 8 degrees of freedom per tag and 1200 in total, so the mean has a standard deviation of 4 %.
  // The covariance includes an allowance for non-Gaussian blur, but the blur here is Gaussian.
  EXPECT_GT(sum / kTrials, 8 * 0.8);
  EXPECT_LT(sum / kTrials, 8 * 1.1);
  EXPECT_LT(bias.norm(), 0.005);
  EXPECT_LT(std::abs(outward), 0.005);
}

/// A drawn sheet, not a photograph: it has no blur, and its edges run along pixel boundaries.
TEST(Refinement, CovarianceIsAlwaysPositiveDefinite) {
  Random random(11);
  for (int trial = 0; trial < 30; ++trial) {
    Print print{
        .side_px = 8 * random.uniform(5, 8), .roll_rad = 0, .lens_px = 1e-4, .black = 0, .white = 255};
    print.behind = print.white;
    print.center_px += Eigen::Vector2d(random.uniform(), random.uniform());
    const auto result = refine_corners(render(print), detection_at(print, 0.1, random), {});
    EXPECT_TRUE(!result.refined() ||
                Eigen::LLT<CornerCovariance>(result.covariance_px2).info() == Eigen::Success)
        << print.side_px << " px at " << print.center_px.transpose() << ":\n"
        << result.covariance_px2;
  }
}

TEST(Refinement, CovarianceGrowsWithNoise) {
  Print print;
  Random random(7);
  const auto sigma = [&](double noise) {
    print.noise = noise;
    const auto result = refine_corners(render(print), detection_at(print, 0.1, random), straight());
    EXPECT_TRUE(result.refined());
    return std::sqrt(result.covariance_px2.trace() / 8);
  };
  const double at_two = sigma(2);
  const double at_eight = sigma(8);
  EXPECT_NEAR(at_eight / at_two, 4, 0.8);
}

/// Correlation between the displacements of two corners along `n`.
double correlation(const CornerCovariance& c, Eigen::Index i, Eigen::Index k, const Eigen::Vector2d& n) {
  const auto block = [&](Eigen::Index p, Eigen::Index q) { return n.dot(c.block<2, 2>(2 * p, 2 * q) * n); };
  return block(i, k) / std::sqrt(block(i, i) * block(k, k));
}

TEST(Refinement, NeighbouringCornersAreCorrelatedThroughTheirEdge) {
  Print print;
  print.noise = 2;
  Random random(8);
  for (const double roll_rad : {0.0, 0.3}) {
    print.roll_rad = roll_rad;
    const auto result = refine_corners(render(print), detection_at(print, 0.1, random), straight());
    ASSERT_TRUE(result.refined());
    const CornerCovariance& c = result.covariance_px2;
    EXPECT_EQ(c, c.transpose());
    EXPECT_EQ(c.llt().info(), Eigen::Success);
    const Eigen::Vector2d along(std::cos(roll_rad), std::sin(roll_rad));
    const Eigen::Vector2d across(-along.y(), along.x());
    // TL and TR are both on the top edge. A slanted edge can rotate about its middle, which results in a
    // negative correlation. Along a row of pixels, the phase of the edge on the pixel grid moves both
    // corners.
    const double shared = correlation(c, 0, 1, across);
    if (roll_rad == 0.0) {
      EXPECT_GT(shared, 0.1);
    } else {
      EXPECT_LT(shared, -0.1);
    }
    // In the direction of the edge the two corners depend on different edges, which are coupled only by
    // levels, blur and illumination.
    EXPECT_LT(std::abs(correlation(c, 0, 1, along)), 0.2);
  }
}

TEST(Refinement, IsInvariantToRotationOfTheImage) {
  Print print;
  print.noise = 2;
  Random random(9);
  const Image image = render(print);
  TagDetection detection = detection_at(print, 0.15, random);
  const auto straight_up = refine_corners(image, detection);
  ASSERT_TRUE(straight_up.refined());
  const int n = print.image_px;
  Image turned(n, n);  // rotated clockwise by a quarter turn: (x, y) -> (n - y, x)
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) turned.row(x)[n - 1 - y] = image.row(y)[x];
  }
  for (auto& corner : detection.corners_px) corner = {n - corner.y(), corner.x()};
  const auto result = refine_corners(turned, detection);
  ASSERT_TRUE(result.refined());
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d expected(n - straight_up.corners_px[k].y(), straight_up.corners_px[k].x());
    // The first pass uses every fourth slice starting at the left, so the results differ, but by far less
    // than the noise.
    EXPECT_LT((result.corners_px[k] - expected).norm(), 0.2 * std::sqrt(result.covariance_px2.trace() / 8));
  }
}

TEST(Refinement, IsRepeatableAndIndependentOfCropping) {
  Print print;
  print.noise = 2;
  Random random(10);
  const Image image = render(print);
  const TagDetection detection = detection_at(print, 0.15, random);
  const auto first = refine_corners(image, detection);
  const auto again = refine_corners(image, detection);
  ASSERT_TRUE(first.refined());
  EXPECT_EQ(first.corners_px, again.corners_px);
  EXPECT_EQ(first.covariance_px2, again.covariance_px2);

  TagDetection shifted = detection;
  for (auto& corner : shifted.corners_px) corner -= Eigen::Vector2d(11, 13);
  const auto in_window = refine_corners(crop(image, 11, 13, 100, 100), shifted);
  ASSERT_TRUE(in_window.refined());
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_LT((in_window.corners_px[k] + Eigen::Vector2d(11, 13) - first.corners_px[k]).norm(), 1e-4);
  }
}

TEST(Refinement, WorksOnPaperCutAtItsMargin) {
  Random random(11);
  for (const double behind : {20.0, 110.0, 230.0}) {
    for (const double margin_cells : {0.0, 0.5, 3.0}) {
      Print print;
      print.side_px = 24;
      print.behind = behind;
      print.margin_cells = margin_cells;
      const auto result = refine_corners(render(print), detection_at(print, 0.1, random), straight());
      ASSERT_TRUE(result.refined());
      EXPECT_LT(worst_error(result.corners_px, print), 0.03) << behind << " " << margin_cells;
    }
  }
}

TEST(Refinement, IgnoresAPartialCoverOnAnEdge) {
  Random random(12);
  for (const std::uint8_t cover : {std::uint8_t{0}, std::uint8_t{120}, std::uint8_t{255}}) {
    Print print;
    print.side_px = 64;
    print.roll_rad = 0.1;
    print.noise = 2;
    Image image = render(print);
    const Corners corners = corners_of(print);
    const Eigen::Vector2d middle = 0.5 * (corners[1] + corners[2]);  // middle of the right edge
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 14; ++x)
        image.row(static_cast<int>(middle.y()) - 4 + y)[static_cast<int>(middle.x()) - 7 + x] = cover;
    }
    const auto result = refine_corners(image, detection_at(print, 0.1, random));
    ASSERT_TRUE(result.refined()) << to_string(result.outcome);
    EXPECT_LT(worst_error(result.corners_px, print), 0.1) << int{cover};
    EXPECT_LT(nees(result, print), 8 * 3) << int{cover};
  }
}

TEST(Refinement, SurvivesOverexposedPaperAndSunkenInk) {
  double sum = 0;
  int trials = 0;
  Random random(13);
  for (int trial = 0; trial < 30; ++trial) {
    Print print;
    print.noise = 2;
    print.white = trial % 2 == 0 ? 290 : 220;
    print.black = trial % 2 == 0 ? 30 : -40;
    print.roll_rad = random.uniform(-3, 3);
    const auto result = refine_corners(render(print, static_cast<std::uint64_t>(trial)),
                                       detection_at(print, 0.1, random), straight());
    ASSERT_TRUE(result.refined());
    EXPECT_LT(worst_error(result.corners_px, print), 0.15);
    sum += nees(result, print);
    ++trials;
  }
  EXPECT_LT(sum / trials, 8 * 1.6);
}

// Tests the cases in which the detector's corners are kept.

void expect_kept(const RefinedCorners& result, const TagDetection& given, RefinementOutcome why) {
  EXPECT_EQ(result.outcome, why) << to_string(result.outcome);
  for (std::size_t k = 0; k < 4; ++k) {
    for (int i = 0; i < 2; ++i) {
      const double kept = result.corners_px[k][i];
      EXPECT_TRUE(kept == given.corners_px[k][i] || (std::isnan(kept) && std::isnan(given.corners_px[k][i])));
    }
  }
  EXPECT_EQ(result.covariance_px2, 0.25 * CornerCovariance::Identity());
}

TEST(RefinementFallback, KeepsTheCornersWithoutATag) {
  Print print;
  Random random(14);
  const TagDetection detection = detection_at(print, 0, random);
  expect_kept(refine_corners(Image(120, 120, 128), detection), detection, RefinementOutcome::LowContrast);
  expect_kept(refine_corners(ImageView(), detection), detection, RefinementOutcome::UnusableQuad);
}

TEST(RefinementFallback, KeepsTheCornersOfInvalidQuads) {
  const Image image = render({});
  Random random(15);
  const TagDetection good = detection_at({}, 0, random);
  const auto kept = [&](auto&& change) {
    TagDetection bad = good;
    change(bad);
    expect_kept(refine_corners(image, bad), bad, RefinementOutcome::UnusableQuad);
  };
  kept([](TagDetection& d) { d.corners_px[2].x() = std::numeric_limits<double>::quiet_NaN(); });
  kept([](TagDetection& d) { d.corners_px[1].y() = std::numeric_limits<double>::infinity(); });
  kept([](TagDetection& d) { d.corners_px[0] = {1e9, -1e9}; });
  kept([](TagDetection& d) { std::swap(d.corners_px[1], d.corners_px[3]); });  // a mirrored quad
  kept([](TagDetection& d) { d.corners_px[2] = d.corners_px[0]; });
  kept([](TagDetection& d) { d.corners_px.fill({60, 60}); });
  kept([](TagDetection& d) { d.tag.number = 587; });
  kept([](TagDetection& d) { d.tag.number = -1; });
}

TEST(RefinementFallback, SmallOrCutTagsAreNotRefined) {
  Random random(16);
  Print small;
  small.side_px = 7.5;
  const TagDetection tiny = detection_at(small, 0, random);
  const RefinedCorners moved = refine_corners(render(small), tiny);
  EXPECT_EQ(moved.outcome, RefinementOutcome::TooSmall);
  EXPECT_LT(worst_error(moved.corners_px, small), 0.5);
  EXPECT_LT(nees(moved, small), 8 * 2.0);
  Print cut;
  cut.center_px = {-4, 60};
  const TagDetection outside = detection_at(cut, 0, random);
  RefinementOptions any;
  any.border_px = 0;
  EXPECT_EQ(refine_corners(render(cut), outside, any).outcome, RefinementOutcome::CutByBorder);
}

/// One cell of the black border may be missing, so the corners have a standard deviation of one cell.
TEST(RefinementFallback, ATagCutByTheBorderIsUncertainByACell) {
  Random random(17);
  Print print;
  TagDetection detection = detection_at(print, 0, random);
  const Image image = render(print);
  ASSERT_TRUE(refine_corners(image, detection).refined());
  double left_px = image.width();
  for (const auto& corner : detection.corners_px) left_px = std::min(left_px, corner.x());
  const double shift_px = left_px + 2;  // two of the five pixels of a cell are cut off at one corner
  const ImageView right{image.row(0) + static_cast<std::ptrdiff_t>(shift_px),
                        image.width() - static_cast<int>(shift_px), image.height(), image.width()};
  for (auto& corner : detection.corners_px) corner.x() -= std::floor(shift_px);
  const auto truth = detection.corners_px;
  for (auto& corner : detection.corners_px) corner.x() = std::max(corner.x(), 0.0);
  const RefinedCorners cut = refine_corners(right, detection);
  EXPECT_EQ(cut.outcome, RefinementOutcome::CutByBorder);
  for (std::size_t k = 0; k < 4; ++k) {
    const auto at = 2 * static_cast<Eigen::Index>(k);
    const double sigma_px = std::sqrt(cut.covariance_px2.block<2, 2>(at, at).trace());
    EXPECT_LT((cut.corners_px[k] - truth[k]).norm(), 3 * sigma_px) << k;
    EXPECT_EQ(cut.corners_px[k], detection.corners_px[k]) << k;
    EXPECT_NEAR(sigma_px, std::sqrt(2.0) * print.side_px / 8, 1) << k;
  }
}

/// The search for the border does not extend that far, but the bits may still locate the tag.
TEST(RefinementFallback, RejectsEdgesFarFromTheDetection) {
  Print print;
  print.side_px = 64;
  Random random(17);
  TagDetection detection = detection_at(print, 0, random);
  for (auto& corner : detection.corners_px) corner += Eigen::Vector2d(2.2, 0);
  const auto by_default = refine_corners(render(print), detection);
  EXPECT_TRUE(!by_default.refined() ||
              (by_default.by_bits && worst_error(by_default.corners_px, print) < 0.1));
  RefinementOptions patient;
  patient.max_shift_px = 3;
  const auto result = refine_corners(render(print), detection, patient);
  EXPECT_TRUE(!result.refined() || worst_error(result.corners_px, print) < 0.05);
}

TEST(RefinementFallback, AlwaysReturnsFiniteNumbers) {
  Random random(18);
  int refined_count = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Image image(50, 40);
    const auto kind = random.index(3);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const auto cell = static_cast<std::uint64_t>((x / 5 + y / 4) % 2);
        image.row(y)[x] = static_cast<std::uint8_t>(kind == 0   ? random.index(256)
                                                    : kind == 1 ? 255 * cell
                                                                : static_cast<std::size_t>(3 * x + y));
      }
    }
    TagDetection detection;
    const FamilyId family_id = kAllFamilies[random.index(kAllFamilies.size())];
    detection.tag = {family_id, static_cast<int>(random.index(family(family_id).codes.size()))};
    const Eigen::Vector2d center(random.uniform(-5, 55), random.uniform(-5, 45));
    for (std::size_t k = 0; k < 4; ++k) {
      const double angle =
          random.uniform(-0.7, 0.7) + std::numbers::pi * (0.5 * static_cast<double>(k) - 0.75);
      detection.corners_px[k] =
          center + random.uniform(1, 40) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
    const auto result = refine_corners(image, detection);
    refined_count += result.refined() ? 1 : 0;
    EXPECT_TRUE(result.covariance_px2.allFinite());
    EXPECT_EQ(result.covariance_px2.llt().info(), Eigen::Success);
    for (const auto& corner : result.corners_px) EXPECT_TRUE(corner.allFinite());
  }
  EXPECT_LT(refined_count, 30);  // none of them contains a tag
}

TEST(RefinementFallback, EveryOutcomeHasAName) {
  for (const auto outcome :
       {RefinementOutcome::Refined, RefinementOutcome::UnusableQuad, RefinementOutcome::TooSmall,
        RefinementOutcome::TooLittleSeen, RefinementOutcome::LowContrast, RefinementOutcome::PoorFit,
        RefinementOutcome::MovedTooFar, RefinementOutcome::CutByBorder}) {
    EXPECT_NE(to_string(outcome), "unknown");
  }
}

}  // namespace
}  // namespace waymark
