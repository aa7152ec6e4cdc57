// The printed size of a tag that is held before the camera.
#include "waymark/app/doctor/doctor_tag_size.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

const CameraModel kCamera =
    CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240}, 640, 480).value();

/// Detections of a tag with this side at this distance, with 0.1 px of noise.
std::vector<TagDetection> held(double size_m, double distance_m, int number = 5) {
  Random random(3);
  std::vector<TagDetection> all(9);
  for (TagDetection& detection : all) {
    detection.tag = {FamilyId::Tag36h11, number};
    const double half_px = 500 * size_m / distance_m / 2;
    const Eigen::Vector2d centre(320, 240);
    const std::array<Eigen::Vector2d, 4> to_corner = {
        Eigen::Vector2d(-half_px, -half_px), {half_px, -half_px}, {half_px, half_px}, {-half_px, half_px}};
    for (std::size_t i = 0; i < 4; ++i)
      detection.corners_px[i] =
          centre + to_corner[i] + 0.1 * Eigen::Vector2d(random.normal(), random.normal());
  }
  return all;
}

TEST(DoctorTagSize, NamesATagThatAPrinterMadeSmaller) {
  const TagSizeTrial trial{.size_m = 0.16, .distance_m = 1.0};
  const DoctorLine right = check_tag_size(held(0.16, 1.0), kCamera, trial);
  EXPECT_EQ(right.level, DoctorLevel::Ok) << right.words;
  EXPECT_TRUE(right.command.empty());
  const DoctorLine small = check_tag_size(held(0.16 * 0.95, 1.0), kCamera, trial);
  EXPECT_EQ(small.level, DoctorLevel::Warn);
  EXPECT_THAT(small.words, HasSubstr("tag36h11:5 at 1.00 m is 15"));
  EXPECT_THAT(small.words, HasSubstr("not 160: printed at 9"));
  EXPECT_THAT(small.command, HasSubstr("--tag-size-m 0.15"));
  const DoctorLine within_tape = check_tag_size(held(0.16 * 0.985, 1.0), kCamera, trial);
  EXPECT_EQ(within_tape.level, DoctorLevel::Ok) << "a tape does not tell 1.5 % at 1 m: " << within_tape.words;
}

TEST(DoctorTagSize, SaysWhatItCannotTell) {
  const TagSizeTrial trial{.size_m = 0.16, .distance_m = 1.0};
  EXPECT_THAT(check_tag_size({}, kCamera, trial).words, HasSubstr("no tag was in view"));
  std::vector<TagDetection> two = held(0.16, 1.0);
  two.front().tag.number = 9;
  EXPECT_THAT(check_tag_size(two, kCamera, trial).words,
              HasSubstr("2 tags are in view (tag36h11:5, tag36h11:9)"));
  std::vector<TagDetection> point = held(0.16, 1.0);
  for (TagDetection& detection : point) detection.corners_px.fill({320, 240});
  EXPECT_THAT(check_tag_size(point, kCamera, trial).words, HasSubstr("no square"));
  const TagSizeTrial near{.size_m = 0.16, .distance_m = 0.25};
  EXPECT_THAT(check_tag_size(held(0.16, 0.25), kCamera, near).words, HasSubstr("not significant"));
}

}  // namespace
}  // namespace waymark
