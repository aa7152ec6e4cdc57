#include "waymark/tags/apriltag3/apriltag_detector.hpp"

#include <array>
#include <bit>
#include <cerrno>
#include <filesystem>
#include <numbers>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/detector_scenes.hpp"
#include "tests/support/golden_page.hpp"

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

TEST_P(EveryFamily, APrintedTagHasItsCornersInOrder) {
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

TEST_P(EveryFamily, UpToMaxHammingBitsAreCorrected) {
  const Family& table = family(GetParam());
  Random random(11);
  for (int max_hamming = 0; max_hamming <= 2; ++max_hamming) {
    auto made = make_apriltag_detector(options_for(GetParam(), max_hamming));
    if (!made) {  // the two-bit tables of the largest families exceed the memory limit
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
        ASSERT_EQ(found.size(), 1U) << flips << " wrong bits; max_hamming is " << max_hamming;
        EXPECT_EQ(found[0].hamming, flips);
        EXPECT_EQ(found[0].tag.number, 5);
      } else {
        EXPECT_TRUE(found.empty()) << flips << " wrong bits; max_hamming is " << max_hamming;
      }
    }
  }
}

TEST(AprilTagDetector, FindsSeveralFamiliesSortedByTag) {
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

TEST(AprilTagDetector, DetectionsBelowTheMinimumMarginAreDropped) {
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

// Tests which images are accepted and that the result does not depend on stride, cropping or threads.

using testing::add_noise;
using testing::same;
using testing::tag_scene;

/// All options that affect how much of a small image the library reads.
std::vector<DetectorOptions> shapes() {
  std::vector<DetectorOptions> all;
  for (const double decimate : {1.0, 1.5, 2.0, 3.0, 4.0, 8.0}) {
    for (const double sigma : {0.0, 0.8, 2.0}) {
      DetectorOptions options;
      options.quad_decimate = decimate;
      options.quad_sigma = sigma;
      options.families = {"tag16h5", "tagCircle21h7"};
      all.push_back(options);
    }
  }
  return all;
}

TEST(AprilTagDetector, SmallImagesAreAccepted) {
  Random random(3);
  Image noise(40, 40);
  add_noise(noise, 200, random);
  for (const DetectorOptions& options : shapes()) {
    const auto detector = detector_with(options);
    for (int height = 0; height <= 40; ++height) {
      for (int width = 0; width <= 40; ++width) {
        const auto found = detector->detect(ImageView{noise.view().data, width, height, 40});
        ASSERT_TRUE(found) << width << " x " << height;
      }
    }
  }
}

TEST(AprilTagDetector, ThinAndEmptyImagesHaveNoTags) {
  const auto detector = detector_with();
  const Image line(5000, 7, 200);
  EXPECT_TRUE(detector->detect(ImageView{line.view().data, 5000, 1, 5000})->empty());
  EXPECT_TRUE(detector->detect(ImageView{line.view().data, 1, 5000, 1})->empty());
  EXPECT_TRUE(detector->detect(ImageView{line.view().data, 5000, 7, 5000})->empty());
  EXPECT_TRUE(detector->detect(ImageView())->empty());
  EXPECT_TRUE(detector->detect(ImageView{line.view().data, -3, 20, 5000})->empty());
}

TEST(AprilTagDetector, ASmallTagInASmallImageIsFound) {
  // A tag of 16h5 is 8 cells wide: at 3 px per cell it fits in an image of 26 px.
  Image image(26, 26, 220);
  paint_tag(image, {FamilyId::Tag16h5, 3}, square_corners({13, 13}, 18, 0));
  EXPECT_EQ(detector_with(options_for(FamilyId::Tag16h5))->detect(image)->size(), 1U);
}

TEST(AprilTagDetector, TooLargeOrInvalidImagesAreRejected) {
  const auto detector = detector_with();
  const std::uint8_t pixel = 0;  // this pixel is never read
  for (const auto& [width, height] : {std::pair(32768, 8), std::pair(8, 32768), std::pair(8193, 8192)}) {
    const auto found = detector->detect(ImageView{&pixel, width, height, width});
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().code, ErrorCode::LimitExceeded);
  }
  const auto found = detector->detect(ImageView{&pixel, 20, 20, 19});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::InvalidArgument);
  testing::expect_on_page("detect", found.error());
}

TEST(AprilTagDetector, ACropGivesTheSameResultAsItsCopy) {
  const Image whole = tag_scene(640, 400, 21, 12);
  for (const double decimate : {1.0, 2.0}) {
    DetectorOptions options;
    options.quad_decimate = decimate;
    const auto detector = detector_with(options);
    for (const auto& [x, y, width, height] :
         {std::array{0, 0, 640, 400}, {13, 7, 333, 301}, {101, 55, 530, 97}}) {
      const ImageView part{whole.row(y) + x, width, height, 640};
      Image copy(width, height);
      for (int row = 0; row < height; ++row) std::copy_n(part.row(row), width, copy.row(row));
      EXPECT_TRUE(same(detector->detect(part).value(), detector->detect(copy).value()));
    }
    EXPECT_GE(detector->detect(whole)->size(), 8U);
  }
}

TEST(AprilTagDetector, RepeatedCallsGiveTheSameResult) {
  const Image first = tag_scene(640, 400, 22, 12);
  const Image other = tag_scene(320, 240, 23, 4);
  const auto detector = detector_with();
  const auto expected = detector->detect(first).value();
  ASSERT_GE(expected.size(), 8U);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(detector->detect(other));
    EXPECT_TRUE(same(detector->detect(first).value(), expected));
  }
  EXPECT_TRUE(same(detector_with()->detect(first).value(), expected));
}

TEST(AprilTagDetector, SeveralThreadsMayShareADetector) {
  const Image first = tag_scene(320, 240, 24, 5);
  const Image other = tag_scene(240, 320, 25, 5);
  const auto detector = detector_with();
  const auto of_first = detector->detect(first).value();
  const auto of_other = detector->detect(other).value();
  std::array<int, 4> right{};
  std::vector<std::thread> threads;
  threads.reserve(right.size());
  for (int& count : right) {
    threads.emplace_back([&] {
      for (int i = 0; i < 5; ++i) {
        count += same(detector->detect(first).value(), of_first) ? 1 : 0;
        count += same(detector->detect(other).value(), of_other) ? 1 : 0;
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_THAT(right, ::testing::Each(10));
}

TEST(AprilTagDetector, RegionsFindTheSameAsTheWholeImage) {
  const Image image = tag_scene(640, 400, 27, 12);
  for (const double decimate : {1.0, 1.5, 2.0}) {
    DetectorOptions options;
    options.quad_decimate = decimate;
    const auto detector = detector_with(options);
    const auto whole = detector->detect(image).value();
    ASSERT_GE(whole.size(), 6U);
    std::vector<PixelRect> regions;
    for (const TagDetection& detection : whole) {
      Eigen::Array2d low = detection.corners_px[0].array();
      Eigen::Array2d high = low;
      for (const Eigen::Vector2d& corner : detection.corners_px) {
        low = low.min(corner.array());
        high = high.max(corner.array());
      }
      const Eigen::Array2i from = low.floor().cast<int>();
      const Eigen::Array2i size = high.ceil().cast<int>() - from;
      regions.push_back({from.x(), from.y(), size.x(), size.y()});
    }
    const auto found = detector->detect(image, regions).value();
    ASSERT_EQ(found.size(), whole.size());
    for (std::size_t i = 0; i < whole.size(); ++i) {
      EXPECT_EQ(found[i].tag, whole[i].tag);
      // libapriltag stores corners as float, which has a resolution of 6e-5 px at 640 px.
      EXPECT_LT(max_corner_error_px(found[i].corners_px, whole[i].corners_px), 1e-4);
    }
  }
}

TEST(AprilTagDetector, CornersFollowThePixelCentreConventionAtAnyDecimation) {
  // Averaged over many subpixel positions and directions, the error is the offset between the pixel
  // conventions.
  constexpr std::array kDecimations = {1.0, 1.5, 2.0, 3.0, 4.0};
  constexpr int kTags = 80;
  std::vector<std::unique_ptr<Detector>> detectors;
  for (const double decimate : kDecimations) {
    DetectorOptions options;
    options.quad_decimate = decimate;
    detectors.push_back(detector_with(options));
  }
  std::array<Eigen::Vector2d, kDecimations.size()> mean;
  mean.fill(Eigen::Vector2d::Zero());
  Random random(7);
  for (int i = 0; i < kTags; ++i) {
    Image image(130, 130, 140);
    const Eigen::Vector2d center(65 + random.uniform(-4, 4), 65 + random.uniform(-4, 4));
    const TagCorners truth = square_corners(center, 64, random.uniform(0, 7));
    paint_tag(image, {FamilyId::Tag36h11, i}, truth);
    for (std::size_t d = 0; d < detectors.size(); ++d) {
      const auto found = detectors[d]->detect(image).value();
      ASSERT_EQ(found.size(), 1U);
      for (std::size_t k = 0; k < 4; ++k) mean.at(d) += (found[0].corners_px[k] - truth[k]) / (4 * kTags);
    }
  }
  for (std::size_t d = 0; d < detectors.size(); ++d) {
    EXPECT_LT(mean.at(d).cwiseAbs().maxCoeff(), 0.015)
        << kDecimations.at(d) << ": " << mean.at(d).transpose();
  }
}

TEST(AprilTagDetector, DoesNotModifyTheImage) {
  const Image image = tag_scene(320, 240, 28, 4);
  const Image before = tag_scene(320, 240, 28, 4);
  for (const double decimate : {1.0, 2.0}) {
    DetectorOptions options;
    options.quad_sigma = 0.8;
    options.quad_decimate = decimate;
    errno = 77;
    EXPECT_GE(detector_with(options)->detect(image)->size(), 1U);
    EXPECT_EQ(errno, 77);
    EXPECT_EQ(image, before);
  }
}

TEST(AprilTagDetector, PrintsNothingAndWritesNoFile) {
  const auto folder = std::filesystem::current_path();
  const auto files = [&] { return std::distance(std::filesystem::directory_iterator(folder), {}); };
  const auto count = files();
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  Random random(9);
  for (const double decimate : {1.0, 2.0}) {
    DetectorOptions options;
    options.quad_decimate = decimate;
    options.min_white_black_diff = 5;
    options.families = {"tag36h11", "tagStandard41h12"};
    const auto detector = detector_with(options);
    for (const double sigma : {3.0, 20.0, 200.0}) {
      Image image = tag_scene(320, 240, 29, 4);
      add_noise(image, sigma, random);
      const auto found = detector->detect(image).value();
      for (const TagDetection& detection : found) {
        for (const auto& corner : detection.corners_px) EXPECT_TRUE(corner.allFinite());
      }
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(files(), count);
}

}  // namespace
}  // namespace waymark
