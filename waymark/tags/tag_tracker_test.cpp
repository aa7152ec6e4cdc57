#include "waymark/tags/tag_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "waymark/base/random.hpp"
#include "waymark/tags/make_detector.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

using testing::max_corner_error_px;
using testing::paint_cells;
using testing::paint_tag;
using testing::square_corners;

/// Counts the calls to the underlying detector.
class CountedDetector final : public Detector {
 public:
  explicit CountedDetector(const DetectorOptions& options) : inner_(make_detector(options).value()) {}
  using Detector::detect;
  [[nodiscard]] Result<std::vector<TagDetection>> detect(const ImageView& image) const override {
    pixels += static_cast<long>(image.width) * image.height;
    return inner_->detect(image);
  }
  mutable long pixels = 0;

 private:
  std::unique_ptr<Detector> inner_;
};

TrackingOptions options_here() {
  TrackingOptions options;
  options.detector.detector = "waymark";
  options.whole_every = 8;
  return options;
}

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

/// Three tags that drift and rotate.
Image image_of_step(int step) {
  Image image(640, 480, 140);
  const double t = step;
  paint_tag(image, tag(1), square_corners({120 + 3.5 * t, 110 + 1.2 * t}, 40, 0.3 + 0.01 * t));
  paint_tag(image, tag(2), square_corners({330 - 2.0 * t, 120}, 90, 1.1));
  paint_tag(image, tag(3), square_corners({300, 350 - 2.5 * t}, 24, 2.0));
  Random random(static_cast<std::uint64_t>(step));
  testing::add_noise(image, 3, random);
  return image;
}

TEST(TagTracker, FindsTheTagsOfTheWholeImageReadingFewPixels) {
  const CountedDetector detector(options_here().detector);
  TagTracker tracker = TagTracker::make(detector, options_here()).value();
  long tracked_pixels = 0;
  for (int step = 0; step < 16; ++step) {
    const Image image = image_of_step(step);
    detector.pixels = 0;
    const TrackedTags found = tracker.next(image).value();
    EXPECT_EQ(found.whole, step % 8 == 0) << step;
    if (!found.whole) tracked_pixels += detector.pixels;
    const auto whole = detector.detect(image).value();
    ASSERT_EQ(found.detections.size(), 3U) << step;
    ASSERT_EQ(whole.size(), 3U) << step;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(found.detections[i].tag, whole[i].tag);
      EXPECT_LT(max_corner_error_px(found.detections[i].corners_px, whole[i].corners_px), 0.15) << step;
    }
    EXPECT_TRUE(found.missed.empty());
  }
  EXPECT_LT(tracked_pixels, 14L * 640 * 480 / 20) << "pixels searched in 14 images";
}

/// Tags of all sizes come into view after the first image. Each is found within as many images as there are
/// strips, and all images cost almost the same.
TEST(TagTracker, StripsFindNewTagsAtConstantCost) {
  TrackingOptions options = options_here();
  options.in_strips = true;
  for (const double side_px : {14.0, 30.0, 60.0, 110.0, 200.0, 400.0}) {
    const CountedDetector detector(options.detector);
    TagTracker tracker = TagTracker::make(detector, options).value();
    Image image(1700, 720, 140);
    EXPECT_TRUE(tracker.next(image).value().whole);
    int number = 0;
    for (const double y : {0.8 * side_px + 4, 360.0, 716 - 0.8 * side_px}) {
      paint_tag(image, tag(number), square_corners({250.0 + 590 * number, y}, side_px, 0.1));
      ++number;
    }
    const auto there = detector.detect(image).value();
    detector.pixels = 0;
    long most = 0;
    std::vector<TagDetection> found;
    for (int i = 0; i < options.whole_every; ++i) {
      const long before = detector.pixels;
      const TrackedTags tracked = tracker.next(image).value();
      EXPECT_FALSE(tracked.whole);
      most = std::max(most, detector.pixels - before);
      found = tracked.detections;
    }
    ASSERT_EQ(found.size(), there.size()) << side_px;
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].tag, there[i].tag) << side_px;
      EXPECT_LT(max_corner_error_px(found[i].corners_px, there[i].corners_px), 0.35) << side_px;
    }
    EXPECT_LT(most, 1700L * 720 * 2 / 5)
        << side_px << " px: eight strips, including their overlap and coarser scales";
  }
}

TEST(TagTracker, AnExpectedTagIsReadWithMoreWrongBits) {
  const CountedDetector detector(options_here().detector);
  TagTracker tracker = TagTracker::make(detector, options_here()).value();
  Image image(640, 480, 140);
  const auto corners = square_corners({300, 200}, 120, 0.2);
  paint_tag(image, tag(3), corners);
  ASSERT_EQ(tracker.next(image).value().detections.size(), 1U);
  // Dirt covers three cells inside; about half of these cells are read wrongly.
  const Family& tags = family(FamilyId::Tag36h11);
  std::vector<std::uint8_t> dirt = bitmap(tag(3));
  std::size_t changed = 0;
  const int margin = (tags.total_width - tags.width_at_border) / 2;
  for (const std::size_t bit : {4U, 20U}) {
    const BitCell& cell = tags.bits[bit];
    std::uint8_t& level =
        dirt[static_cast<std::size_t>((cell.y + margin) * tags.total_width + cell.x + margin)];
    level = level == 0 ? 255 : 0;
    ++changed;
  }
  paint_cells(image, tags, dirt, corners);
  EXPECT_TRUE(detector.detect(image).value().empty()) << "two bits are wrong, but only one is corrected";
  const auto found = tracker.next(image).value().detections;
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].tag, tag(3));
  EXPECT_EQ(found[0].hamming, static_cast<int>(changed));
}

TEST(TagTracker, ATagThatJumpsIsFoundNearItsLastPosition) {
  const CountedDetector detector(options_here().detector);
  for (const double side : {30.0, 160.0}) {
    TagTracker tracker = TagTracker::make(detector, options_here()).value();
    Image before(640, 480, 140), after(640, 480, 140);
    paint_tag(before, tag(5), square_corners({300, 240}, side, 0.4));
    const auto truth = square_corners({300 + 0.4 * side, 240 - 0.3 * side}, side, 0.5);
    paint_tag(after, tag(5), truth);
    ASSERT_EQ(tracker.next(before)->detections.size(), 1U);
    detector.pixels = 0;
    const TrackedTags found = tracker.next(after).value();
    ASSERT_EQ(found.detections.size(), 1U) << side;
    EXPECT_LT(max_corner_error_px(found.detections[0].corners_px, truth), 0.5);
    EXPECT_LT(detector.pixels, 640 * 480 / 2) << "a large tag is searched for at a smaller scale";
  }
}

TEST(TagTracker, ExpectedTagsNeedNoPreviousImage) {
  const CountedDetector detector(options_here().detector);
  TagTracker tracker = TagTracker::make(detector, options_here()).value();
  Image image(640, 480, 140);
  ASSERT_TRUE(tracker.next(image)->detections.empty());
  const auto truth = square_corners({300, 240}, 50, 0.4);
  paint_tag(image, tag(5), truth);
  const ExpectedTag expected{tag(5), square_corners({302, 239}, 51, 0.41)};
  detector.pixels = 0;
  const TrackedTags found = tracker.next(image, std::vector{expected}).value();
  ASSERT_EQ(found.detections.size(), 1U);
  EXPECT_EQ(detector.pixels, 0);
  EXPECT_LT(max_corner_error_px(found.detections[0].corners_px, truth), 0.3);
}

TEST(TagTracker, AnotherTagAtThePositionIsNotConfused) {
  const CountedDetector detector(options_here().detector);
  TagTracker tracker = TagTracker::make(detector, options_here()).value();
  Image image(640, 480, 140);
  const auto place = square_corners({300, 240}, 50, 0.4);
  paint_tag(image, tag(6), place);
  ASSERT_EQ(tracker.next(image)->detections.size(), 1U);
  const TrackedTags found = tracker.next(image, std::vector{ExpectedTag{tag(5), place}}).value();
  ASSERT_EQ(found.detections.size(), 1U);
  EXPECT_EQ(found.detections[0].tag, tag(6));
  ASSERT_EQ(found.missed.size(), 1U);
  EXPECT_EQ(found.missed[0].expected.tag, tag(5));
  EXPECT_EQ(found.missed[0].why, MissReason::Occluded);
}

TEST(TagTracker, ReportsWhyATagWasNotFound) {
  const auto why = [](const Image& image, const testing::TagCorners& corners) {
    return why_missed(image, {tag(5), corners}, 8, 15);
  };
  const auto place = square_corners({300, 240}, 48, 0.2);
  Image covered(640, 480, 140);
  paint_tag(covered, tag(5), place);
  for (int y = 220; y < 250; ++y) std::fill(covered.row(y) + 290, covered.row(y) + 320, std::uint8_t{90});
  EXPECT_EQ(why(covered, place), MissReason::Occluded);
  Image dark(640, 480, 9);
  paint_tag(dark, tag(5), place, 4, 12);
  EXPECT_EQ(why(dark, place), MissReason::TooFaint);
  EXPECT_EQ(why(dark, square_corners({10, 240}, 48, 0.2)), MissReason::Outside);
  EXPECT_EQ(why(dark, square_corners({-500, 240}, 48, 0.2)), MissReason::Outside);
  Image blurred(640, 480, 140);
  paint_tag(blurred, tag(5), place);
  const Image sharp = blurred;
  for (int y = 20; y < 460; ++y) {
    for (int x = 20; x < 620; ++x) {
      int sum = 0;
      for (int k = -12; k <= 12; ++k) sum += sharp.row(y)[x + k];
      blurred.row(y)[x] = static_cast<std::uint8_t>(sum / 25);
    }
  }
  const Image across = blurred;
  for (int y = 20; y < 460; ++y) {
    for (int x = 20; x < 620; ++x) {
      int sum = 0;
      for (int k = -12; k <= 12; ++k) sum += across.row(y + k)[x];
      blurred.row(y)[x] = static_cast<std::uint8_t>(sum / 25);
    }
  }
  EXPECT_EQ(why(blurred, place), MissReason::Blurred);
}

TEST(TagTracker, OptionsOutOfRangeAreRejected) {
  const CountedDetector detector(options_here().detector);
  TrackingOptions options = options_here();
  options.whole_every = 0;
  EXPECT_EQ(TagTracker::make(detector, options).error().place.key, "whole_every");
  options = options_here();
  options.detector.families = {"tag1h1"};
  EXPECT_FALSE(TagTracker::make(detector, options));
}

TEST(TagSequence, TracksIfTheFinderEnablesIt) {
  auto counted = std::make_unique<CountedDetector>(options_here().detector);
  const CountedDetector& detector = *counted;
  TagFinder finder = make_tag_finder(std::move(counted)).value();
  for (const bool tracking : {false, true}) {
    if (tracking) finder.tracking = options_here();
    TagSequence sequence(finder);
    for (int step = 0; step < 3; ++step) {
      detector.pixels = 0;
      const Image image = image_of_step(step);
      const FoundTags found = sequence.find(image, ImageLens::unknown()).value();
      EXPECT_EQ(found.detections.size(), 3U);
      EXPECT_EQ(found.refinements.size(), 3U);
      EXPECT_EQ(detector.pixels >= 640 * 480, !tracking || step == 0) << step;
    }
  }
}

TEST(TagTracker, AcceptsAnyExpectation) {
  const CountedDetector detector(options_here().detector);
  TagTracker tracker = TagTracker::make(detector, options_here()).value();
  Image image(64, 48, 140);
  paint_tag(image, tag(5), square_corners({30, 24}, 20, 0.4));
  const double nan = std::nan("");
  const std::vector<ExpectedTag> odd = {{tag(5), square_corners({1e300, 1e300}, 20, 0)},
                                        {tag(5), square_corners({nan, 0}, 20, 0)},
                                        {tag(5), square_corners({30, 24}, 0, 0)},
                                        {tag(5), square_corners({30, 24}, 1e9, 0)},
                                        {tag(5), square_corners({30, 24}, -20, 0)},
                                        {{FamilyId::Tag16h5, 3}, square_corners({30, 24}, 20, 0)}};
  for (int step = 0; step < 4; ++step) {
    const TrackedTags found = tracker.next(image, odd).value();
    EXPECT_EQ(found.detections.size(), 1U);
  }
  EXPECT_TRUE(tracker.next({})->detections.empty());
}

}  // namespace
}  // namespace waymark
