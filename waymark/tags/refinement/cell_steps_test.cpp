// The placement of corners by the steps between cells, which decides whether kept corners are reliable.
#include "waymark/tags/refinement/cell_steps.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/facing_tag.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark {
namespace {

using refinement::contradicts;
using refinement::place_by_steps;
using refinement::StepPlacement;
using testing::corners_of;
using testing::detection_at;
using testing::Print;
using testing::render;

Print print_of(FamilyId id, double roll_rad) {
  Print print;
  print.tag = {id, 3};
  print.roll_rad = roll_rad;
  print.side_px = 7.0 * family(id).width_at_border;
  print.noise = 2;
  return print;
}

/// The largest distance from the corners of the steps to the true ones.
double worst_px(const StepPlacement& steps, const refinement::Quad& from, const Print& print) {
  const auto truth = corners_of(print);
  double worst = 0;
  for (std::size_t k = 0; k < 4; ++k)
    worst = std::max(worst, (from[k] + steps.shift_px[k] - truth[k]).norm());
  return worst;
}

/// Multiplies the light on one side of a line through the middle of the tag.
Image shadowed(const Print& print, double light) {
  Image image = render(print);
  const auto corners = corners_of(print);
  const Eigen::Vector2d middle = (corners[0] + corners[2]) / 2;
  const Eigen::Vector2d normal(std::cos(0.4), std::sin(0.4));
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      if (normal.dot(Eigen::Vector2d(x + 0.5, y + 0.5) - middle) > 0)
        image.row(y)[x] = static_cast<std::uint8_t>(std::lround(image.row(y)[x] * light));
  return image;
}

TEST(CellSteps, PlaceTheCornersOfEveryFamily) {
  Random random(3);
  for (const FamilyId id : kAllFamilies) {
    for (const double roll_rad : {0.3, 2.0}) {
      const Print print = print_of(id, roll_rad);
      auto from = corners_of(print);
      for (auto& corner : from) corner += Eigen::Vector2d(random.uniform(-2, 2), random.uniform(-2, 2));
      const StepPlacement steps = place_by_steps(render(print), {print.tag}, from);
      EXPECT_GT(steps.share, 0.7) << to_string(id);
      EXPECT_LT(worst_px(steps, from, print), 0.5) << to_string(id) << " " << roll_rad;
    }
  }
}

TEST(CellSteps, AreNotMovedByAShadow) {
  const Print print = print_of(FamilyId::Tag36h11, 0.2);
  const auto truth = corners_of(print);
  for (const double light : {0.7, 0.5, 0.35}) {
    const StepPlacement steps = place_by_steps(shadowed(print, light), {print.tag}, truth);
    EXPECT_LT(worst_px(steps, truth, print), 0.4) << light;
    EXPECT_FALSE(contradicts(steps, 0.25 * CornerCovariance::Identity())) << light;
  }
}

TEST(CellSteps, ContradictCornersThatAreOffByMoreThanTheyState) {
  const Print print = print_of(FamilyId::Tag36h11, 0.7);
  const CornerCovariance stated = 0.25 * CornerCovariance::Identity();
  for (std::size_t k = 0; k < 4; ++k) {
    auto from = corners_of(print);
    from[k] += Eigen::Vector2d(0.4, -0.3);
    EXPECT_FALSE(contradicts(place_by_steps(render(print), {print.tag}, from), stated)) << k;
    from[k] += Eigen::Vector2d(1.6, -1.2);
    const StepPlacement steps = place_by_steps(render(print), {print.tag}, from);
    EXPECT_TRUE(contradicts(steps, stated)) << k;
    EXPECT_FALSE(contradicts(steps, 4 * CornerCovariance::Identity())) << "the error is stated " << k;
  }
}

TEST(CellSteps, ContradictCornersWithoutSteps) {
  const Print print = print_of(FamilyId::Tag36h11, 0.7);
  const Image blank(render(print).width(), render(print).height(), 120);
  const StepPlacement steps = place_by_steps(blank, {print.tag}, corners_of(print));
  EXPECT_EQ(steps.share, 0);
  EXPECT_TRUE(contradicts(steps, CornerCovariance::Identity()));
  for (const auto& shift : steps.shift_px) EXPECT_TRUE(shift.allFinite());
}

TEST(CornerState, IsUnreliableOnlyForKeptCornersThatTheImageContradicts) {
  Random random(17);
  const Print print = print_of(FamilyId::Tag36h11, 0.7);
  EXPECT_EQ(refine_corners(render(print), detection_at(print, 0.3, random)).state, CornerState::Measured);
  // A fit of the border fails in the shadow, but the corners are right.
  const RefinedCorners in_shadow = refine_corners(shadowed(print, 0.4), detection_at(print, 0.1, random));
  EXPECT_EQ(in_shadow.state, CornerState::Measured) << to_string(in_shadow.outcome);
  // One corner is off by half a cell, and the shadow keeps both fits from finding it.
  TagDetection off = detection_at(print, 0, random);
  off.corners_px[2] += Eigen::Vector2d(2.6, 2.6);
  const RefinedCorners kept = refine_corners(shadowed(print, 0.4), off);
  EXPECT_FALSE(kept.refined());
  EXPECT_EQ(kept.state, CornerState::Unreliable) << to_string(kept.outcome);
}

}  // namespace
}  // namespace waymark
