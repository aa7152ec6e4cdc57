#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/facing_tag.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement.hpp"

namespace waymark {
namespace {

using testing::detection_at;
using testing::Print;
using testing::render;
using testing::worst_error;

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

TEST(RefinementFallback, KeepsTheCornersOfWhatIsNoTagThere) {
  Print print;
  Random random(14);
  const TagDetection detection = detection_at(print, 0, random);
  expect_kept(refine_corners(Image(120, 120, 128), detection), detection, RefinementOutcome::LowContrast);
  expect_kept(refine_corners(ImageView(), detection), detection, RefinementOutcome::UnusableQuad);
  Image inverted = render(print);
  for (int y = 0; y < inverted.height(); ++y) {
    for (int x = 0; x < inverted.width(); ++x)
      inverted.row(y)[x] = static_cast<std::uint8_t>(255 - inverted.row(y)[x]);
  }
  EXPECT_FALSE(refine_corners(inverted, detection).refined());
}

TEST(RefinementFallback, KeepsTheCornersOfQuadsThatMakeNoSense) {
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
  kept([](TagDetection& d) { std::swap(d.corners_px[1], d.corners_px[3]); });  // mirrored
  kept([](TagDetection& d) { d.corners_px[2] = d.corners_px[0]; });
  kept([](TagDetection& d) { d.corners_px.fill({60, 60}); });
  kept([](TagDetection& d) { d.tag.number = 587; });
  kept([](TagDetection& d) { d.tag.number = -1; });
}

TEST(RefinementFallback, KeepsTheCornersOfTagsTooSmallOrCutOff) {
  Random random(16);
  Print small;
  small.side_px = 7.5;
  const TagDetection tiny = detection_at(small, 0, random);
  expect_kept(refine_corners(render(small), tiny), tiny, RefinementOutcome::TooSmall);
  Print cut;
  cut.center_px = {-4, 60};
  const TagDetection outside = detection_at(cut, 0, random);
  RefinementOptions any;
  any.border_px = 0;
  EXPECT_EQ(refine_corners(render(cut), outside, any).outcome, RefinementOutcome::CutByBorder);
}

/// The quad of a tag that the border of the image cuts is a cell too short at most: that is what is said of
/// it.
TEST(RefinementFallback, ATagThatTheBorderCutsIsKnownToACell) {
  Random random(17);
  Print print;
  TagDetection detection = detection_at(print, 0, random);
  const Image image = render(print);
  ASSERT_TRUE(refine_corners(image, detection).refined());
  const double cell_px = mean_side_px(detection.corners_px) / 8;
  const double shift_px = detection.corners_px[0].x() - 2;  // two pixels are left of the border
  const ImageView right{image.row(0) + static_cast<std::ptrdiff_t>(shift_px),
                        image.width() - static_cast<int>(shift_px), image.height(), image.width()};
  for (auto& corner : detection.corners_px) corner.x() -= std::floor(shift_px);
  const RefinedCorners cut = refine_corners(right, detection);
  EXPECT_EQ(cut.outcome, RefinementOutcome::CutByBorder);
  EXPECT_EQ(cut.corners_px, detection.corners_px);
  EXPECT_NEAR(std::sqrt(cut.covariance_px2(0, 0)), cell_px, 0.1 * cell_px);
  EXPECT_NEAR(std::sqrt(cut.covariance_px2(7, 7)), cell_px, 0.1 * cell_px);
}

/// The border is not looked for so far away; the bits may tell where the tag is.
TEST(RefinementFallback, BelievesNoEdgeThatIsElsewhere) {
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

TEST(RefinementFallback, AlwaysAnswersWithNumbers) {
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
  EXPECT_LT(refined_count, 30);  // there is no tag in any of them
}

TEST(RefinementFallback, SaysEveryOutcomeInAWord) {
  for (const auto outcome :
       {RefinementOutcome::Refined, RefinementOutcome::UnusableQuad, RefinementOutcome::TooSmall,
        RefinementOutcome::TooLittleSeen, RefinementOutcome::LowContrast, RefinementOutcome::PoorFit,
        RefinementOutcome::MovedTooFar, RefinementOutcome::CutByBorder}) {
    EXPECT_NE(to_string(outcome), "unknown");
  }
}

}  // namespace
}  // namespace waymark
