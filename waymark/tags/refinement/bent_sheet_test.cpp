#include "waymark/tags/refinement/bent_sheet.hpp"

#include <algorithm>
#include <cstdint>

#include <gtest/gtest.h>

#include "tests/support/bent_tags.hpp"
#include "tests/support/draw_tag.hpp"
#include "waymark/base/random.hpp"

namespace waymark::refinement {
namespace {

using testing::add_noise;
using testing::Bend;
using testing::bent_tag;
using testing::BentTag;
using testing::BentTagOptions;
using testing::paint_tag;
using testing::square_corners;

constexpr int kRounds = 12;

/// A flat tag of 80 px, with 10 px per cell.
struct FlatTag {
  TagId tag;
  Quad truth = square_corners({80, 80}, 80, 0);
  Image image = Image(160, 160, 140);

  explicit FlatTag(int number) : tag{FamilyId::Tag36h11, number} { paint_tag(image, tag, truth); }

  void cover_rows(int from, int to, std::uint8_t level) {
    for (int y = from; y < to; ++y)
      for (int x = 20; x < 140; ++x) image.row(y)[x] = level;
  }
};

TEST(BentSheet, IsConfirmedOnABottleUnderAShakingCameraAndOnCrumpledPaper) {
  for (const BentTagOptions& options :
       {BentTagOptions{Bend::Cylinder, 60, 90}, {Bend::Wobble, 0.04, 90}, {Bend::Crumpled, 0.04, 90}}) {
    int confirmed = 0;
    for (std::uint64_t seed = 1; seed <= kRounds; ++seed) {
      const BentTag bent = bent_tag(options, seed);
      const PrintedTag print{bent.truth.tag};
      const auto border = follow_border(bent.image, print, bent.truth.corners_px);
      ASSERT_TRUE(border) << seed;
      const SheetComparison bits = compare_sheets(bent.image, print, *border, bent.truth.corners_px);
      confirmed += bits.confirms_bend() ? 1 : 0;
    }
    // Crumpled paper may also bend inside, where its border does not show it.
    EXPECT_GE(confirmed, kRounds - 2) << testing::to_string(options.bend);
  }
}

TEST(BentSheet, IsNotConfirmedOnAFlatTag) {
  Random random(3);
  for (int round = 0; round < kRounds; ++round) {
    FlatTag flat(round);
    add_noise(flat.image, 2, random);
    const auto border = follow_border(flat.image, {flat.tag}, flat.truth);
    ASSERT_TRUE(border) << round;
    const SheetComparison bits = compare_sheets(flat.image, {flat.tag}, *border, flat.truth);
    EXPECT_LT(bits.if_flat, 4e-4) << round;
    EXPECT_FALSE(bits.confirms_bend()) << round;
  }
}

// The edge of the bar is as straight as a border, and its corners are 3 to 7 px away from those of the tag.
TEST(BentSheet, IsNotConfirmedIfABarCoversOneSide) {
  Random random(7);
  for (int round = 0; round < 4 * kRounds; ++round) {
    FlatTag flat(round);
    const bool bright = round % 2 == 0;
    const int edge = 40 + (bright ? 1 : -1) * static_cast<int>(random.uniform(3, 8));
    flat.cover_rows(bright ? 25 : edge, bright ? edge : 45, bright ? 220 : 30);
    add_noise(flat.image, 2, random);
    Quad near = flat.truth;
    near[0].y() = near[1].y() = edge;
    const auto border = follow_border(flat.image, {flat.tag}, near);
    if (!border) continue;
    EXPECT_FALSE(compare_sheets(flat.image, {flat.tag}, *border, near).confirms_bend()) << round;
  }
}

}  // namespace
}  // namespace waymark::refinement
