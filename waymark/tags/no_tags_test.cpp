#include "waymark/tags/no_tags.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using testing::add_noise;
using testing::paint_tag;
using testing::square_corners;

/// A scene with one tag.
Image scene(FamilyId id = FamilyId::Tag36h11, double side_px = 80) {
  Random random(7);
  Image image(320, 240, 140);
  paint_tag(image, {id, 5}, square_corners({160, 120}, side_px, 0.2));
  add_noise(image, 2, random);
  return image;
}

std::optional<NoTagReason> reason_for(const Image& image, const DetectorOptions& options = {}) {
  NoTagDiagnosis diagnosis;
  diagnosis.add(image, 0);
  return diagnosis.reason(options);
}

template <class Change>
Image each_pixel(Image image, Change change) {
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) image.row(y)[x] = change(image.row(y)[x]);
  return image;
}

TEST(NoTagDiagnosis, NamesTheFamily) {
  const auto reason = reason_for(scene(FamilyId::TagStandard41h12));
  ASSERT_TRUE(reason);
  EXPECT_EQ(reason->cause, NoTagCause::OtherFamily);
  EXPECT_THAT(reason->message, ::testing::HasSubstr("family=tagStandard41h12"));
}

TEST(NoTagDiagnosis, RecognisesMirroredAndInvertedImages) {
  Image mirrored = scene();
  for (int y = 0; y < mirrored.height(); ++y)
    std::reverse(mirrored.row(y), mirrored.row(y) + mirrored.width());
  const auto in_mirrored = reason_for(mirrored);
  ASSERT_TRUE(in_mirrored);
  EXPECT_EQ(in_mirrored->cause, NoTagCause::Mirrored);
  const Image inverted = each_pixel(scene(), [](int v) { return static_cast<std::uint8_t>(255 - v); });
  const auto in_inverted = reason_for(inverted);
  ASSERT_TRUE(in_inverted);
  EXPECT_EQ(in_inverted->cause, NoTagCause::Inverted);
}

TEST(NoTagDiagnosis, RecognisesDarkBrightAndFaintImages) {
  const auto in_bright =
      reason_for(each_pixel(scene(), [](int v) { return static_cast<std::uint8_t>(240 + v / 32); }));
  ASSERT_TRUE(in_bright);
  EXPECT_EQ(in_bright->cause, NoTagCause::Bright);
  const auto in_dark =
      reason_for(each_pixel(scene(), [](int v) { return static_cast<std::uint8_t>(v / 16); }));
  ASSERT_TRUE(in_dark);
  EXPECT_EQ(in_dark->cause, NoTagCause::Dark);
  const auto in_faint =
      reason_for(each_pixel(scene(), [](int v) { return static_cast<std::uint8_t>(120 + v / 16); }));
  ASSERT_TRUE(in_faint);
  EXPECT_EQ(in_faint->cause, NoTagCause::Faint);
}

TEST(NoTagDiagnosis, HasNoResultWithoutEvidence) {
  Random random(9);
  Image clutter(320, 240);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) clutter.row(y)[x] = static_cast<std::uint8_t>(random.index(256));
  EXPECT_FALSE(reason_for(clutter));
}

TEST(NoTagDiagnosis, HasNoResultIfSomeImagesContainATag) {
  NoTagDiagnosis diagnosis;
  diagnosis.add(scene(FamilyId::Tag25h9), 0);
  diagnosis.add(scene(), 1);
  diagnosis.add(scene(FamilyId::Tag25h9), 0);
  EXPECT_FALSE(diagnosis.reason({}));
  EXPECT_FALSE(NoTagDiagnosis().reason({}));
}

/// A family with few bits is occasionally found in clutter, although the tags are of another one.
TEST(NoTagDiagnosis, NamesTheFamilyIfHardlyAnyImageContainsATag) {
  NoTagDiagnosis diagnosis;
  diagnosis.add(scene(), 1);
  for (int i = 0; i < 18; ++i) diagnosis.add(scene(FamilyId::TagStandard41h12), 0);
  EXPECT_FALSE(diagnosis.reason({}));
  diagnosis.add(scene(FamilyId::TagStandard41h12), 0);
  const auto reason = diagnosis.reason({});
  ASSERT_TRUE(reason);
  EXPECT_EQ(reason->cause, NoTagCause::OtherFamily);
}

}  // namespace
}  // namespace waymark
