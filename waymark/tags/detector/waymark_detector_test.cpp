#include "waymark/tags/detector/waymark_detector.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "waymark/base/random.hpp"
#include "waymark/tags/detector/tag_search.hpp"

namespace waymark {
namespace {

using testing::add_noise;
using testing::max_corner_error_px;
using testing::paint_cells;
using testing::paint_tag;
using testing::square_corners;
using testing::TagCorners;

std::unique_ptr<Detector> made(const DetectorOptions& options = {}) {
  auto detector = make_waymark_detector(options);
  EXPECT_TRUE(detector) << to_string(detector.error());
  return std::move(detector).value();
}

DetectorOptions only(FamilyId id) {
  DetectorOptions options;
  options.families = {std::string(to_string(id))};
  options.max_hamming = 0;
  return options;
}

TagCorners in_the_middle(double side_px, double angle_rad) {
  return square_corners({100.3, 99.6}, side_px, angle_rad);
}

class EveryFamilyHere : public ::testing::TestWithParam<FamilyId> {};
INSTANTIATE_TEST_SUITE_P(Families, EveryFamilyHere, ::testing::ValuesIn(kAllFamilies),
                         [](const auto& of) { return std::string(to_string(of.param)); });

TEST_P(EveryFamilyHere, HasItsCornersInPrintedOrderInEveryDirection) {
  const auto detector = made(only(GetParam()));
  const std::size_t codes = family(GetParam()).codes.size();
  Random random(3);
  for (int step = 0; step < 24; ++step) {
    const TagId tag{GetParam(), static_cast<int>(random.index(codes))};
    const TagCorners truth = in_the_middle(60, step * 2 * std::numbers::pi / 24);
    Image image(200, 200, 140);
    paint_tag(image, tag, truth);
    const auto found = detector->detect(image).value();
    ASSERT_EQ(found.size(), 1U) << to_string(tag) << ", step " << step;
    EXPECT_EQ(found[0].tag, tag);
    EXPECT_EQ(found[0].hamming, 0);
    EXPECT_GT(found[0].decision_margin, 30);
    EXPECT_LT(max_corner_error_px(found[0].corners_px, truth), 0.5) << to_string(tag) << ", step " << step;
  }
}

TEST_P(EveryFamilyHere, SeveralTagsAreDistinguished) {
  DetectorOptions options;
  for (const FamilyId id : kAllFamilies) options.families.emplace_back(to_string(id));
  options.max_hamming = 0;
  Image image(200, 200, 140);
  const TagId tag{GetParam(), 1};
  paint_tag(image, tag, in_the_middle(90, 0.4));
  const auto found = made(options)->detect(image).value();
  EXPECT_EQ(std::count_if(found.begin(), found.end(), [&](const auto& one) { return one.tag == tag; }), 1);
}

/// Tests that the families may be listed in any order, also for tags with a covered side, which are read by
/// another method.
TEST_P(EveryFamilyHere, IsReadInAnyOrderOfFamilies) {
  Image image(200, 200, 140);
  const TagId tag{GetParam(), 1};
  const TagCorners corners = in_the_middle(90, 0.4);
  paint_tag(image, tag, corners);
  Image covered = image;
  for (int y = 60; y < 150; ++y)
    for (int x = 138; x < 150; ++x) covered.row(y)[x] = 25;
  for (const FamilyId other : kAllFamilies) {
    for (const bool first : {true, false}) {
      DetectorOptions options;
      options.families = {std::string(to_string(first ? GetParam() : other)),
                          std::string(to_string(first ? other : GetParam()))};
      options.max_hamming = 0;
      const auto detector = made(options);
      const auto found = detector->detect(image).value();
      EXPECT_TRUE(std::ranges::any_of(found, [&](const auto& one) { return one.tag == tag; }))
          << to_string(other);
      EXPECT_TRUE(detector->detect(covered)) << to_string(other);
    }
  }
}

TEST_P(EveryFamilyHere, MirroredPrintsAreNotDetected) {
  const auto detector = made(only(GetParam()));
  Image image(200, 200, 140);
  paint_tag(image, {GetParam(), 2}, in_the_middle(80, 0.2));
  for (int y = 0; y < image.height(); ++y) std::reverse(image.row(y), image.row(y) + image.width());
  EXPECT_TRUE(detector->detect(image).value().empty());
}

TEST_P(EveryFamilyHere, InvertedPrintsAreFoundOnRequest) {
  DetectorOptions options = only(GetParam());
  Image image(200, 200, 140);
  const TagId tag{GetParam(), 3};
  const TagCorners truth = in_the_middle(80, 1.1);
  paint_tag(image, tag, truth, 220, 30);  // with black printed bright and white printed dark
  EXPECT_TRUE(made(options)->detect(image).value().empty());
  options.find_inverted = true;
  const auto found = made(options)->detect(image).value();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].tag, tag);
  EXPECT_LT(max_corner_error_px(found[0].corners_px, truth), 0.5);
}

TEST(WaymarkDetector, CorrectsUpToMaxHammingBits) {
  const Family& kind = family(FamilyId::Tag36h11);
  for (const int wrong : {0, 1, 2, 3}) {
    std::vector<std::uint8_t> cells = bitmap({kind.id, 7});
    for (int i = 0; i < wrong; ++i) {  // each of these bits is on the wrong side, but fainter than the others
      const BitCell& bit = kind.bits[static_cast<std::size_t>(9 * i + 4)];
      std::uint8_t& cell = cells[static_cast<std::size_t>((bit.y + 1) * kind.total_width + bit.x + 1)];
      cell = cell == 0 ? 255 : 0;
    }
    Image image(200, 200, 140);
    paint_cells(image, kind, cells, in_the_middle(80, 0.3));
    Image faint = image;
    paint_tag(faint, {kind.id, 7}, in_the_middle(80, 0.3));
    for (int y = 0; y < 200;
         ++y) {  // wrong bits are only three quarters as far from the threshold as the others
      for (int x = 0; x < 200; ++x) {
        const int difference = image.row(y)[x] - faint.row(y)[x];
        image.row(y)[x] = static_cast<std::uint8_t>(faint.row(y)[x] + difference * 7 / 8);
      }
    }
    DetectorOptions options;
    for (options.max_hamming = 0; options.max_hamming <= 2; ++options.max_hamming) {
      const auto found = made(options)->detect(image).value();
      ASSERT_EQ(found.size(), wrong <= options.max_hamming ? 1U : 0U)
          << wrong << " wrong bits; max_hamming is " << options.max_hamming;
      for (const TagDetection& tag : found) EXPECT_EQ(tag.hamming, wrong);
    }
  }
}

TEST(WaymarkDetector, AnySizeAndStrideIsAccepted) {
  const auto detector = made();
  Random random(17);
  for (int round = 0; round < 400; ++round) {
    const int width = 1 + static_cast<int>(random.index(round < 200 ? 12 : 90));
    const int height = 1 + static_cast<int>(random.index(round < 200 ? 12 : 90));
    const int stride = width + static_cast<int>(random.index(7));
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(stride * (height - 1) + width));
    const std::uint64_t kind = random.index(4);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      const auto noise = static_cast<std::uint8_t>(random.index(256));
      const bool square =
          (i / static_cast<std::size_t>(stride) / 4 + i % static_cast<std::size_t>(stride) / 4) % 2 == 0;
      bytes[i] = kind == 0 ? noise : (kind == 1 ? 0 : (kind == 2 ? 255 : (square ? 255 : 0)));
    }
    const auto found = detector->detect({bytes.data(), width, height, stride});
    ASSERT_TRUE(found) << to_string(found.error());
    EXPECT_TRUE(found->empty()) << width << " x " << height;
  }
  EXPECT_TRUE(detector->detect(ImageView{}).value().empty());
}

TEST(WaymarkDetector, TheStrideDoesNotMatter) {
  Image image(203, 150, 140);
  paint_tag(image, {FamilyId::Tag36h11, 12}, square_corners({90, 70}, 50, 0.5));
  Random random(2);
  add_noise(image, 3, random);
  Image wide(260, 150, 7);
  for (int y = 0; y < 150; ++y) std::copy(image.row(y), image.row(y) + 203, wide.row(y) + 31);
  const auto a = made()->detect(image).value();
  const auto b = made()->detect(ImageView{wide.row(0) + 31, 203, 150, 260}).value();
  ASSERT_EQ(a.size(), 1U);
  ASSERT_EQ(b.size(), 1U);
  EXPECT_EQ(a[0].corners_px, b[0].corners_px);
  EXPECT_EQ(a[0].decision_margin, b[0].decision_margin);
}

// The border of tagCustom48h12 is bright, that of tag36h11 dark: the inner tag is found first.
TEST(WaymarkDetector, ATagInTheHoleOfATagOfAnotherFamilyHidesNeither) {
  DetectorOptions options;
  options.families = {"tag36h11", "tagCustom48h12"};
  const auto detector = made(options);
  for (int number = 0; number < 6; ++number) {
    const TagId outer{FamilyId::TagCustom48h12, number};
    const TagId inner{FamilyId::Tag36h11, number};
    const TagCorners corners = in_the_middle(90, 0.2 * number);
    TagCorners inner_corners = corners;
    for (Eigen::Vector2d& corner : inner_corners)
      corner = Eigen::Vector2d(100.3, 99.6) + 0.24 * (corner - Eigen::Vector2d(100.3, 99.6));
    Image image(200, 200, 140);
    paint_tag(image, outer, corners);
    paint_tag(image, inner, inner_corners);
    const auto found = detector->detect(image).value();
    ASSERT_EQ(found.size(), 2U) << number;
    EXPECT_EQ(found[0].tag, inner);
    EXPECT_EQ(found[1].tag, outer);
  }
}

TEST(WaymarkDetector, TooLargeImagesAreRejected) {
  const std::uint8_t pixel = 0;
  const auto narrow = made()->detect({&pixel, 40, 40, 39});
  ASSERT_FALSE(narrow);
  EXPECT_EQ(narrow.error().code, ErrorCode::InvalidArgument);
  const auto large = made()->detect({&pixel, 40000, 40, 40000});
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().code, ErrorCode::LimitExceeded);
}

TEST(WaymarkDetector, AllKernelsFindTheSame) {
  const std::vector<search::ReadableFamily> families = {{family(FamilyId::Tag36h11), 2},
                                                        {family(FamilyId::TagStandard41h12), 2}};
  Random random(29);
  for (const search::PlaneKernels* kernels : search::runnable_plane_kernels()) {
    search::TagSearch best({});
    search::TagSearch other({}, *kernels);
    for (int round = 0; round < 6; ++round) {
      Image image(301, 203, 140);
      const FamilyId id = round % 2 == 0 ? FamilyId::Tag36h11 : FamilyId::TagStandard41h12;
      paint_tag(image, {id, round}, square_corners({140, 100}, 30 + 10 * round, round));
      add_noise(image, 5, random);
      const auto& a = best.run(image, families);
      const auto& b = other.run(image, families);
      ASSERT_EQ(a.size(), b.size());
      EXPECT_EQ(a.size(), 1U) << round;
      for (std::size_t i = 0; i < a.size(); ++i) {
        EXPECT_EQ(a[i].tag, b[i].tag);
        EXPECT_EQ(a[i].corners_px, b[i].corners_px);
      }
    }
  }
}

TEST(WaymarkDetector, RandomFramesAreRarelyTags) {
  // A black frame on white with random bits inside is a quad with a perfect border: only the codes
  // distinguish it from a tag. With two corrected bits, there are 587 codes, 4 turns and 667 error patterns
  // among 2^36 words, that is, one in 44 000.
  DetectorOptions options;
  options.max_hamming = 2;
  const auto detector = made(options);
  const Family& kind = family(FamilyId::Tag36h11);
  Random random(41);
  std::size_t found = 0;
  for (int index = 0; index < 12; ++index) {
    Image image(600, 440, 200);
    for (int row = 0; row < 9; ++row) {
      for (int column = 0; column < 12; ++column) {
        std::vector<std::uint8_t> cells = bitmap({kind.id, 0});
        for (const BitCell& bit : kind.bits) {
          const auto at = static_cast<std::size_t>((bit.y + 1) * kind.total_width + bit.x + 1);
          cells[at] = random.uniform() < 0.5 ? 0 : 255;
        }
        paint_cells(image, kind, cells, square_corners({25.0 + 49 * column, 25.0 + 48 * row}, 32, 0));
      }
    }
    found += detector->detect(image)->size();
  }
  EXPECT_EQ(found, 0U) << "tags found in 1296 frames";
}

TEST(WaymarkDetector, NoiseHasNoTags) {
  const auto detector = made();
  Random random(43);
  for (const double sigma : {2.0, 8.0, 30.0, 100.0}) {
    Image image(640, 480, 128);
    add_noise(image, sigma, random);
    EXPECT_TRUE(detector->detect(image).value().empty()) << sigma;
  }
}

TEST(WaymarkDetector, RegionsFindTheSameAsTheWholeImage) {
  Image image(400, 300, 140);
  paint_tag(image, {FamilyId::Tag36h11, 1}, square_corners({100, 100}, 50, 0.5));
  paint_tag(image, {FamilyId::Tag36h11, 2}, square_corners({300, 200}, 50, 0.2));
  const auto detector = made();
  ASSERT_EQ(detector->detect(image)->size(), 2U);
  const std::vector<PixelRect> regions = {{250, 150, 100, 100}};
  const auto found = detector->detect(image, regions).value();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].tag.number, 2);
}

}  // namespace
}  // namespace waymark
