#include "waymark/tags/detector.hpp"

#include <algorithm>
#include <functional>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using testing::square_corners;

TagDetection reading(int number, const Eigen::Vector2d& center_px, int hamming = 0, double margin = 50) {
  TagDetection detection;
  detection.tag.number = number;
  detection.hamming = hamming;
  detection.decision_margin = margin;
  detection.corners_px = square_corners(center_px, 10, 0.3);
  return detection;
}

std::vector<int> numbers(const std::vector<TagDetection>& detections) {
  std::vector<int> out;
  out.reserve(detections.size());
  for (const TagDetection& detection : detections) out.push_back(detection.tag.number);
  return out;
}

/// Reports a tag around every white pixel of the image and records its input.
class WhitePixels final : public Detector {
 public:
  using Detector::detect;
  [[nodiscard]] Result<std::vector<TagDetection>> detect(const ImageView& image) const override {
    shown.push_back(image);
    if (failing) return fail(ErrorCode::LimitExceeded, "too large");
    std::vector<TagDetection> detections;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        if (image.at(x, y) > 0) detections.push_back(reading(image.at(x, y), {x + 0.5, y + 0.5}));
      }
    }
    sort_detections(detections);
    return detections;
  }
  mutable std::vector<ImageView> shown;
  bool failing = false;
  int alignment_px = 1;

 private:
  [[nodiscard]] int region_alignment_px() const override { return alignment_px; }
};

TEST(Regions, ReportTagsInsideInImageCoordinates) {
  Image image(300, 200);
  image.row(60)[100] = 7;
  image.row(60)[139] = 8;
  image.row(60)[140] = 9;  // just outside the rectangle
  const WhitePixels detector;
  const std::vector<PixelRect> regions = {{90, 50, 50, 30}};
  const auto found = detector.detect(image, regions).value();
  EXPECT_THAT(numbers(found), ElementsAre(7, 8));
  EXPECT_LT(testing::max_corner_error_px(found[0].corners_px, square_corners({100.5, 60.5}, 10, 0.3)), 1e-12);
}

TEST(Regions, IncludeAMarginClippedToTheImage) {
  const Image image(300, 200);
  const WhitePixels detector;
  const int far = std::numeric_limits<int>::max();
  const std::vector<PixelRect> regions = {
      {100, 100, 20, 20}, {-50, -50, 60, 60}, {-5, -5, far, far}, {290, 195, far, far}};
  EXPECT_TRUE(detector.detect(image, regions)->empty());
  ASSERT_EQ(detector.shown.size(), 4U);
  EXPECT_EQ(detector.shown[0].data, image.view().row(84) + 84);
  EXPECT_EQ(detector.shown[0].width, 52);
  EXPECT_EQ(detector.shown[1].data, image.view().data);
  EXPECT_EQ(detector.shown[1].width, 26);
  EXPECT_EQ(detector.shown[2].width, 300);
  EXPECT_EQ(detector.shown[2].height, 200);
  EXPECT_EQ(detector.shown[3].width, 26);
  EXPECT_EQ(detector.shown[3].height, 21);
}

TEST(Regions, AreAlignedForTheDetector) {
  const Image image(300, 200);
  WhitePixels detector;
  detector.alignment_px = 8;
  const std::vector<PixelRect> regions = {{101, 101, 20, 20}};
  ASSERT_TRUE(detector.detect(image, regions));
  EXPECT_EQ(detector.shown[0].data, image.view().row(80) + 80);
  EXPECT_EQ(detector.shown[0].width, 137 - 80);
}

TEST(Regions, OutsideTheImageOrWithoutAreaHaveNoTags) {
  Image image(30, 20, 1);
  const WhitePixels detector;
  const std::vector<PixelRect> regions = {
      {40, 0, 5, 5}, {-9, 0, 5, 5}, {5, 5, 0, 4}, {5, 5, -3, 4}, {5, 5, 4, -3}};
  EXPECT_TRUE(detector.detect(image, regions)->empty());
  EXPECT_TRUE(detector.detect(image, std::span<const PixelRect>())->empty());
  EXPECT_TRUE(detector.detect(ImageView(), std::vector<PixelRect>{{0, 0, 9, 9}})->empty());
  EXPECT_TRUE(detector.shown.empty());
}

TEST(Regions, ATagInTwoRegionsIsReportedOnce) {
  Image image(300, 200);
  image.row(60)[100] = 7;
  image.row(90)[200] = 7;  // another print of the same tag
  const WhitePixels detector;
  const std::vector<PixelRect> regions = {{50, 20, 100, 100}, {90, 50, 150, 60}, {0, 0, 300, 200}};
  EXPECT_THAT(numbers(detector.detect(image, regions).value()), ElementsAre(7, 7));
}

TEST(Regions, PropagateAnError) {
  const Image image(300, 200);
  WhitePixels detector;
  detector.failing = true;
  const auto found = detector.detect(image, std::vector<PixelRect>{{0, 0, 50, 50}});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::LimitExceeded);
}

TEST(RemoveDuplicates, KeepsTheBetterReading) {
  std::vector<TagDetection> detections = {reading(3, {50, 50}, 1, 90), reading(3, {51, 50}, 0, 20),
                                          reading(3, {49, 50}, 0, 30)};
  remove_duplicates(detections);
  ASSERT_EQ(detections.size(), 1U);
  EXPECT_EQ(detections[0].decision_margin, 30);
}

TEST(RemoveDuplicates, KeepsOtherTagsFamiliesAndPrints) {
  std::vector<TagDetection> detections = {reading(3, {50, 50}), reading(4, {50, 50}), reading(3, {70, 50}),
                                          reading(3, {50, 50})};
  detections[3].tag.family = FamilyId::Tag16h5;
  remove_duplicates(detections);
  EXPECT_EQ(detections.size(), 4U);
}

TEST(RemoveDuplicates, DoesNotDependOnTheOrder) {
  Random random(5);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<TagDetection> detections;
    detections.reserve(30);
    for (int i = 0; i < 30; ++i) {
      detections.push_back(reading(static_cast<int>(random.index(2)),
                                   {random.uniform(0, 60), random.uniform(0, 60)},
                                   static_cast<int>(random.index(3)), random.uniform(0, 99)));
    }
    std::vector<TagDetection> shuffled = detections;
    for (std::size_t i = shuffled.size(); i > 1; --i) std::swap(shuffled[i - 1], shuffled[random.index(i)]);
    remove_duplicates(detections);
    remove_duplicates(shuffled);
    ASSERT_EQ(detections.size(), shuffled.size());
    for (std::size_t i = 0; i < detections.size(); ++i) {
      EXPECT_EQ(detections[i].corners_px, shuffled[i].corners_px);
      EXPECT_EQ(detections[i].decision_margin, shuffled[i].decision_margin);
    }
    const std::size_t count = detections.size();
    remove_duplicates(detections);
    EXPECT_EQ(detections.size(), count);
  }
}

TEST(RemoveDuplicates, TouchingIsNotOverlapping) {
  TagDetection left = reading(1, {0, 0});
  TagDetection right = left;
  left.corners_px = square_corners({5, 5}, 10, 0);
  right.corners_px = square_corners({15, 5}, 10, 0);
  std::vector<TagDetection> detections = {right, left};
  remove_duplicates(detections);
  ASSERT_EQ(detections.size(), 2U);
  EXPECT_LT(detections[0].corners_px[0].x(), detections[1].corners_px[0].x());
}

TEST(DetectorOptions, EveryFieldIsListedOnce) {
  const std::vector<std::string> names = field_names<DetectorOptions>();
  EXPECT_EQ(names.size(), 11U);
  EXPECT_EQ(std::count(names.begin(), names.end(), "quad_decimate"), 1);
}

TEST(DetectorOptions, InvalidOptionsAreRejected) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<std::string, std::function<void(DetectorOptions&)>>> wrong = {
      {"max_hamming", [](auto& o) { o.max_hamming = 3; }},
      {"max_hamming", [](auto& o) { o.max_hamming = -1; }},
      {"quad_decimate", [](auto& o) { o.quad_decimate = 0; }},
      {"quad_decimate", [](auto& o) { o.quad_decimate = 2.5; }},
      {"quad_decimate", [](auto& o) { o.quad_decimate = 1.0001; }},
      {"quad_decimate", [&](auto& o) { o.quad_decimate = nan; }},
      {"quad_sigma", [](auto& o) { o.quad_sigma = -0.8; }},
      {"quad_sigma", [&](auto& o) { o.quad_sigma = nan; }},
      {"decode_sharpening", [](auto& o) { o.decode_sharpening = 5; }},
      {"min_white_black_diff", [](auto& o) { o.min_white_black_diff = 0; }},
      {"memory_limit_mib", [](auto& o) { o.memory_limit_mib = 0; }},
      {"families", [](auto& o) { o.families = {}; }},
      {"families",
       [](auto& o) {
         o.families = {"tag36h11", "tag36h12"};
       }},
  };
  for (const auto& [key, change] : wrong) {
    DetectorOptions options;
    change(options);
    const auto made = make_apriltag_detector(options);
    ASSERT_FALSE(made) << key;
    EXPECT_EQ(made.error().code, ErrorCode::InvalidArgument) << key;
    EXPECT_EQ(made.error().place.key, key);
    EXPECT_FALSE(made.error().hint.empty()) << key;
    testing::expect_on_page("detect", made.error());
  }
}

TEST(DetectorOptions, TablesBeyondTheMemoryLimitAreRejectedBeforeAllocation) {
  DetectorOptions options;
  options.families = {"tagStandard52h13"};
  options.max_hamming = 2;
  const auto made = make_apriltag_detector(options);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(made.error().place.key, "max_hamming");
  EXPECT_NE(made.error().message.find("6033 MiB"), std::string::npos);
  testing::expect_on_page("detect", made.error());
}

TEST(DetectorOptions, AllFamiliesTogetherFitTheDefaultLimit) {
  DetectorOptions options;
  std::int64_t bytes = 0;
  for (const FamilyId id : kAllFamilies) bytes += decode_table_bytes(family(id), options.max_hamming);
  EXPECT_LT(bytes, std::int64_t{options.memory_limit_mib} << 20);
}

}  // namespace
}  // namespace waymark
