#include "waymark/tags/apriltag_detector.hpp"

#include <array>
#include <bit>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/detector_scenes.hpp"

namespace waymark {
namespace {

using testing::detector_with;
using testing::max_corner_error_px;
using testing::options_for;
using testing::paint_tag;
using testing::square_corners;
using testing::TagCorners;

class EveryFamily : public ::testing::TestWithParam<FamilyId> {};
INSTANTIATE_TEST_SUITE_P(All, EveryFamily, ::testing::ValuesIn(kAllFamilies),
                         [](const auto& family_id) { return std::string(to_string(family_id.param)); });

TEST_P(EveryFamily, PrintedTagIsReadWithItsCornersInOrder) {
  const Family& table = family(GetParam());
  const auto detector = detector_with(options_for(GetParam()));
  const int last = static_cast<int>(table.codes.size()) - 1;
  for (const int number : {0, 17, last}) {
    for (int turn = 0; turn < 6; ++turn) {
      const double angle = turn < 4 ? turn * std::numbers::pi / 2 : turn - 3.5;
      Image image(240, 240, 140);
      const TagCorners truth = square_corners({120.3, 119.6}, 10.0 * table.width_at_border, angle);
      paint_tag(image, {GetParam(), number}, truth);
      const auto found = detector->detect(image).value();
      ASSERT_EQ(found.size(), 1U) << number << " turned " << angle;
      EXPECT_EQ(found[0].tag, (TagId{GetParam(), number}));
      EXPECT_EQ(found[0].hamming, 0);
      EXPECT_GT(found[0].decision_margin, 50);
      EXPECT_LT(max_corner_error_px(found[0].corners_px, truth), 0.4) << number << " turned " << angle;
    }
  }
}

TEST_P(EveryFamily, AsManyWrongBitsAreCorrectedAsAskedForAndNoMore) {
  const Family& table = family(GetParam());
  Random random(11);
  for (int max_hamming = 0; max_hamming <= 2; ++max_hamming) {
    auto made = make_apriltag_detector(options_for(GetParam(), max_hamming));
    if (!made) {  // the two-bit tables of the largest families
      EXPECT_EQ(made.error().code, ErrorCode::LimitExceeded);
      EXPECT_GT(decode_table_bytes(table, max_hamming), std::int64_t{512} << 20);
      continue;
    }
    for (int flips = 0; flips <= 3; ++flips) {
      std::vector<std::uint8_t> cells = bitmap({GetParam(), 5});
      std::uint64_t flipped = 0;
      while (std::popcount(flipped) < flips) flipped |= std::uint64_t{1} << random.index(table.bits.size());
      const int margin = (table.total_width - table.width_at_border) / 2;
      for (std::size_t bit = 0; bit < table.bits.size(); ++bit) {
        if (((flipped >> bit) & 1U) == 0) continue;
        const int index = (table.bits[bit].y + margin) * table.total_width + table.bits[bit].x + margin;
        auto& cell = cells.at(static_cast<std::size_t>(index));
        cell = static_cast<std::uint8_t>(255 - cell);
      }
      Image image(200, 200, 140);
      testing::paint_cells(image, table, cells,
                           square_corners({100, 100}, 10.0 * table.width_at_border, 0.2));
      const auto found = (*made)->detect(image).value();
      if (flips <= max_hamming) {
        ASSERT_EQ(found.size(), 1U) << flips << " wrong bits, corrected " << max_hamming;
        EXPECT_EQ(found[0].hamming, flips);
        EXPECT_EQ(found[0].tag.number, 5);
      } else {
        EXPECT_TRUE(found.empty()) << flips << " wrong bits, corrected " << max_hamming;
      }
    }
  }
}

TEST(AprilTagDetector, SeesSeveralFamiliesAtOnceAndSortsByTag) {
  DetectorOptions options;
  options.families = {"tagStandard41h12", "36h11", "tag16h5", "tag36h11"};
  const auto detector = detector_with(options);
  Image image(400, 200, 140);
  paint_tag(image, {FamilyId::TagStandard41h12, 3}, square_corners({60, 60}, 40, 0.1));
  paint_tag(image, {FamilyId::Tag36h11, 9}, square_corners({180, 60}, 60, 0.1));
  paint_tag(image, {FamilyId::Tag36h11, 2}, square_corners({300, 60}, 60, 0.1));
  paint_tag(image, {FamilyId::Tag16h5, 4}, square_corners({180, 150}, 60, 0.1));
  const auto found = detector->detect(image).value();
  ASSERT_EQ(found.size(), 4U);
  EXPECT_EQ(found[0].tag, (TagId{FamilyId::Tag16h5, 4}));
  EXPECT_EQ(found[1].tag, (TagId{FamilyId::Tag36h11, 2}));
  EXPECT_EQ(found[2].tag, (TagId{FamilyId::Tag36h11, 9}));
  EXPECT_EQ(found[3].tag, (TagId{FamilyId::TagStandard41h12, 3}));
}

TEST(AprilTagDetector, TwoPrintsOfOneTagAreBothReported) {
  Image image(400, 200, 140);
  paint_tag(image, {FamilyId::Tag36h11, 9}, square_corners({280, 100}, 60, 0.1));
  paint_tag(image, {FamilyId::Tag36h11, 9}, square_corners({100, 100}, 60, 0.1));
  const auto found = detector_with()->detect(image).value();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_LT(found[0].corners_px[0].x(), found[1].corners_px[0].x());
}

TEST(AprilTagDetector, MarginsBelowTheLeastAreLeftOut) {
  Image image(400, 200, 100);
  paint_tag(image, {FamilyId::Tag36h11, 1}, square_corners({280, 100}, 60, 0.1));
  paint_tag(image, {FamilyId::Tag36h11, 2}, square_corners({100, 100}, 60, 0.1), 90, 130);
  DetectorOptions options;
  const auto both = detector_with()->detect(image).value();
  ASSERT_EQ(both.size(), 2U);
  options.min_decision_margin = (both[0].decision_margin + both[1].decision_margin) / 2;
  const auto found = detector_with(options)->detect(image).value();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].tag.number, 1);
}

}  // namespace
}  // namespace waymark
