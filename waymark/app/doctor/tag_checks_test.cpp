// Tests the reasons reported for map tags that a stationary camera misses, and the measured size of a printed
// tag in front of the camera.
#include "waymark/app/doctor/tag_checks.hpp"

#include <array>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const CameraModel kCamera =
    CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240}, 640, 480).value();

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

/// Four tags in different planes in front of the camera, which is at the map origin, and one tag behind it.
TagMap wall() {
  TagMap map;
  for (int number = 0; number < 4; ++number)
    map.tags[tag(number)] = {
        .map_T_tag = SE3(SO3(), {0.4 * number - 0.6, 0.1 * (number % 2), number % 2 == 0 ? 1.5 : 1.2}),
        .size_m = 0.2};
  map.tags[tag(9)] = {.map_T_tag = SE3(SO3(), {0, 0, -1.5}), .size_m = 0.2};
  return map;
}

using Levels = std::array<double, 2>;  ///< grey levels of black and white

/// An image of the wall; `levels` returns the grey levels of each tag.
Image painted_wall(const std::function<Levels(int)>& levels, std::uint64_t seed) {
  Image image(640, 480, 140);
  for (const auto& [id, mapped] : wall().tags) {
    const auto corners = visible_corners(kCamera, mapped.map_T_tag, mapped.size_m);
    if (!corners) continue;
    testing::paint_tag(image, id, *corners, levels(id.number)[0], levels(id.number)[1]);
  }
  Random random(seed);
  testing::add_noise(image, 1, random);
  return image;
}

constexpr Levels kPlain = {30, 220};

/// The result for ten images of the wall, each modified by `change`.
DoctorLine looked_at(const std::function<Levels(int)>& levels,
                     const std::function<void(Image&, int)>& change) {
  DetectorOptions options;
  const auto finder = make_tag_finder(options).value();
  MapTagTrial trial;
  for (int i = 0; i < 10; ++i) {
    Image image = painted_wall(levels, static_cast<std::uint64_t>(i));
    change(image, i);
    const auto found = find_tags(image.view(), finder, ImageLens::of(kCamera)).value();
    trial.add(image.view(), found.detections, wall(), kCamera, options.min_white_black_diff);
  }
  return check_map_tags(trial, "waymark detect SOURCE view=true");
}

void cover(Image& image, int left, int right) {
  for (int y = 150; y < 330; ++y)
    for (int x = left; x < right; ++x) image.row(y)[x] = static_cast<std::uint8_t>((x * 7 + y * 13) % 200);
}

const auto kNothing = [](Image&, int) {};
const auto kAllPlain = [](int) { return kPlain; };

TEST(DoctorMap, IsOkIfAllExpectedTagsAreDetected) {
  const DoctorLine line = looked_at(kAllPlain, kNothing);
  EXPECT_EQ(line.level, DoctorLevel::Ok) << line.message;
  EXPECT_THAT(line.message, AllOf(HasSubstr("4 map tags"), HasSubstr("10 images")));
  testing::expect_on_page("doctor", line.message);
  EXPECT_TRUE(line.command.empty());
}

TEST(DoctorMap, NamesATagThatIsCoveredOrFaint) {
  const DoctorLine covered = looked_at(kAllPlain, [](Image& image, int) { cover(image, 80, 160); });
  EXPECT_EQ(covered.level, DoctorLevel::Warn);
  // If only three tags are detected, the camera pose is ambiguous in some images.
  EXPECT_THAT(covered.message,
              AllOf(HasSubstr("4 map tags"), HasSubstr("1 missed: tag36h11:0 in "), HasSubstr(" occluded)")));
  testing::expect_on_page("doctor", covered.message);
  EXPECT_THAT(covered.command, HasSubstr("view=true"));
  const auto faint = [](int number) { return number == 2 ? Levels{139, 141} : kPlain; };
  EXPECT_THAT(looked_at(faint, kNothing).message,
              AllOf(HasSubstr("1 missed: tag36h11:2 in "), HasSubstr(" too faint)")));
}

/// The tag is covered in one out of ten images, as by a person walking past.
TEST(DoctorMap, IgnoresATagThatIsMissedOnce) {
  const auto once = [](Image& image, int i) {
    if (i == 4) cover(image, 80, 160);
  };
  EXPECT_EQ(looked_at(kAllPlain, once).level, DoctorLevel::Ok);
}

TEST(DoctorMap, ReportsWhyTagsCannotBeChecked) {
  const DoctorLine empty = looked_at(kAllPlain, [](Image& image, int) { image = Image(640, 480, 90); });
  EXPECT_EQ(empty.level, DoctorLevel::Fail);
  EXPECT_THAT(empty.message, HasSubstr("10 images"));
  testing::expect_on_page("doctor", empty.message);
  // Two tags in the map are swapped.
  DetectorOptions options;
  const auto finder = make_tag_finder(options).value();
  TagMap exchanged = wall();
  std::swap(exchanged.tags[tag(0)], exchanged.tags[tag(3)]);
  exchanged.tags.erase(tag(1));
  exchanged.tags.erase(tag(2));
  const Image image = painted_wall(kAllPlain, 1);
  MapTagTrial trial;
  trial.add(image.view(), find_tags(image.view(), finder, ImageLens::of(kCamera))->detections, exchanged,
            kCamera, options.min_white_black_diff);
  const DoctorLine line = check_map_tags(trial, "");
  EXPECT_EQ(line.level, DoctorLevel::Warn);
  testing::expect_on_page("doctor", line.message);
}

/// Detections of a tag with this side length at this distance, with 0.1 px of noise.
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

TEST(DoctorTagSize, ReportsATagThatIsPrintedTooSmall) {
  const TagSizeTrial trial{.size_m = 0.16, .distance_m = 1.0};
  const DoctorLine right = check_tag_size(held(0.16, 1.0), kCamera, trial);
  EXPECT_EQ(right.level, DoctorLevel::Ok) << right.message;
  EXPECT_TRUE(right.command.empty());
  const DoctorLine small = check_tag_size(held(0.16 * 0.95, 1.0), kCamera, trial);
  EXPECT_EQ(small.level, DoctorLevel::Warn);
  EXPECT_THAT(small.message, HasSubstr("tag36h11:5 at 1.00 m is 15"));
  EXPECT_THAT(small.message, HasSubstr("not 160: "));
  testing::expect_on_page("doctor", small.message);
  EXPECT_THAT(small.command, HasSubstr("tag_size_m=0.15"));
  const DoctorLine within_tape = check_tag_size(held(0.16 * 0.985, 1.0), kCamera, trial);
  EXPECT_EQ(within_tape.level, DoctorLevel::Ok)
      << "1.5 % at 1 m is within the accuracy of a tape: " << within_tape.message;
}

TEST(DoctorTagSize, ReportsWhyASizeCannotBeMeasured) {
  const TagSizeTrial trial{.size_m = 0.16, .distance_m = 1.0};
  const auto expect_warning = [](const DoctorLine& line) {
    EXPECT_EQ(line.level, DoctorLevel::Warn);
    testing::expect_on_page("doctor", line.message);
  };
  expect_warning(check_tag_size({}, kCamera, trial));
  std::vector<TagDetection> two = held(0.16, 1.0);
  two.front().tag.number = 9;
  EXPECT_THAT(check_tag_size(two, kCamera, trial).message, HasSubstr("(tag36h11:5, tag36h11:9)"));
  expect_warning(check_tag_size(two, kCamera, trial));
  std::vector<TagDetection> point = held(0.16, 1.0);
  for (TagDetection& detection : point) detection.corners_px.fill({320, 240});
  expect_warning(check_tag_size(point, kCamera, trial));
  const TagSizeTrial near{.size_m = 0.16, .distance_m = 0.25};
  expect_warning(check_tag_size(held(0.16, 0.25), kCamera, near));
}

}  // namespace
}  // namespace waymark
