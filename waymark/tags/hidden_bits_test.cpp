// Tags whose bits one threshold does not tell: in a hard shadow, or under a bar.
#include <cmath>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "waymark/base/random.hpp"
#include "waymark/tags/waymark_detector.hpp"

namespace waymark {
namespace {

using testing::add_noise;
using testing::max_corner_error_px;
using testing::paint_tag;
using testing::square_corners;
using testing::TagCorners;

std::unique_ptr<Detector> uncorrected() {
  DetectorOptions options;
  options.max_hamming = 0;
  return make_waymark_detector(options).value();
}

TagCorners in_the_middle(double side_px, double angle_rad) {
  return square_corners({100.3, 99.6}, side_px, angle_rad);
}

TEST(HiddenBits, ReadsTagsAcrossWhichAHardShadowFalls) {
  const auto detector = uncorrected();
  Random random(17);
  int found_count = 0;
  for (int round = 0; round < 40; ++round) {
    const TagId tag{FamilyId::Tag36h11, round};
    const double angle = random.uniform(0, 2 * std::numbers::pi);
    const double offset = random.uniform(-15, 15);
    Image image(200, 200, 170);
    paint_tag(image, tag, in_the_middle(60, random.uniform(0, 6)), 30, 210);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const bool dark = std::cos(angle) * (x - 100) + std::sin(angle) * (y - 100) < offset;
        if (dark) image.row(y)[x] = static_cast<std::uint8_t>(image.row(y)[x] * 2 / 5);
      }
    }
    add_noise(image, 2, random);
    const auto found = detector->detect(image).value();
    for (const TagDetection& one : found) EXPECT_EQ(one.tag, tag) << round;
    found_count += static_cast<int>(found.size());
  }
  EXPECT_GE(found_count, 38) << "seed 17";
}

TEST(HiddenBits, ReadsTagsOfWhichABarCoversMoreThanTheBorder) {
  const auto detector = uncorrected();
  Random random(18);
  int found_count = 0;
  for (int round = 0; round < 40; ++round) {
    const TagId tag{FamilyId::Tag36h11, round};
    const TagCorners truth = in_the_middle(64, 0);
    Image image(200, 200, 140);
    paint_tag(image, tag, truth);
    // A bright bar of 1.7 cells on the left side: also the middles of six bits are under it.
    const int left = static_cast<int>(truth[0].x());
    for (int y = 0; y < image.height(); ++y)
      for (int x = left - 3; x < left + 14; ++x) image.row(y)[x] = 170;
    add_noise(image, 2, random);
    const auto found = detector->detect(image).value();
    for (const TagDetection& one : found) EXPECT_EQ(one.tag, tag) << round;
    found_count += static_cast<int>(found.size());
    for (const TagDetection& one : found) EXPECT_LT(max_corner_error_px(one.corners_px, truth), 2) << round;
  }
  EXPECT_GE(found_count, 36) << "seed 18";
}

}  // namespace
}  // namespace waymark
