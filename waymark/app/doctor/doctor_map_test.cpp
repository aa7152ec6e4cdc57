// Which tags of a map a camera that stands does not find, and why.
#include "waymark/app/doctor/doctor_map.hpp"

#include <array>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const CameraModel kCamera =
    CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240}, 640, 480).value();

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

/// Four tags before the camera, which is the map's origin, not in one plane, and one behind it.
TagMap wall() {
  TagMap map;
  for (int number = 0; number < 4; ++number)
    map.tags[tag(number)] = {
        .map_T_tag = SE3(SO3(), {0.4 * number - 0.6, 0.1 * (number % 2), number % 2 == 0 ? 1.5 : 1.2}),
        .size_m = 0.2};
  map.tags[tag(9)] = {.map_T_tag = SE3(SO3(), {0, 0, -1.5}), .size_m = 0.2};
  return map;
}

using Levels = std::array<double, 2>;  ///< of black and white

/// The wall; `levels` of each tag.
Image picture(const std::function<Levels(int)>& levels, std::uint64_t seed) {
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

/// Ten pictures of the wall, changed by `change`.
DoctorLine looked_at(const std::function<Levels(int)>& levels,
                     const std::function<void(Image&, int)>& change) {
  DetectorOptions options;
  const auto finder = make_tag_finder(options).value();
  MapTagTrial trial;
  for (int i = 0; i < 10; ++i) {
    Image image = picture(levels, static_cast<std::uint64_t>(i));
    change(image, i);
    const auto found = find_tags(image.view(), finder, &kCamera).value();
    trial.add(image.view(), found.detections, wall(), kCamera, options.min_white_black_diff);
  }
  return check_map_tags(trial, "waymark detect SOURCE --view");
}

void cover(Image& image, int left, int right) {
  for (int y = 150; y < 330; ++y)
    for (int x = left; x < right; ++x) image.row(y)[x] = static_cast<std::uint8_t>((x * 7 + y * 13) % 200);
}

const auto kNothing = [](Image&, int) {};
const auto kAllPlain = [](int) { return kPlain; };

TEST(DoctorMap, IsContentWhereAllIsFoundThatShouldBe) {
  const DoctorLine line = looked_at(kAllPlain, kNothing);
  EXPECT_EQ(line.level, DoctorLevel::Ok) << line.words;
  EXPECT_THAT(line.words, HasSubstr("4 tags of the map should be found from here and are, in 10 pictures"));
  EXPECT_TRUE(line.command.empty());
}

TEST(DoctorMap, NamesATagThatIsCoveredOrFaint) {
  const DoctorLine covered = looked_at(kAllPlain, [](Image& image, int) { cover(image, 80, 160); });
  EXPECT_EQ(covered.level, DoctorLevel::Warn);
  // Of three tags some pictures do not tell where the camera is.
  EXPECT_THAT(
      covered.words,
      HasSubstr("of 4 tags of the map that should be found from here, one is missed: tag36h11:0 in "));
  EXPECT_THAT(covered.words, HasSubstr(" occluded)"));
  EXPECT_THAT(covered.command, HasSubstr("--view"));
  const auto faint = [](int number) { return number == 2 ? Levels{139, 141} : kPlain; };
  EXPECT_THAT(looked_at(faint, kNothing).words,
              AllOf(HasSubstr("one is missed: tag36h11:2 in "), HasSubstr(" too faint)")));
}

/// One picture of ten is somebody who walks by.
TEST(DoctorMap, SaysNothingOfATagThatIsMissedOnce) {
  const auto once = [](Image& image, int i) {
    if (i == 4) cover(image, 80, 160);
  };
  EXPECT_EQ(looked_at(kAllPlain, once).level, DoctorLevel::Ok);
}

TEST(DoctorMap, SaysWhatKeepsItFromKnowing) {
  EXPECT_THAT(looked_at(kAllPlain, [](Image& image, int) { image = Image(640, 480, 90); }).words,
              HasSubstr("no tag of the map is found in 10 pictures"));
  // Two tags of the map, each where the other should be.
  DetectorOptions options;
  const auto finder = make_tag_finder(options).value();
  TagMap exchanged = wall();
  std::swap(exchanged.tags[tag(0)], exchanged.tags[tag(3)]);
  exchanged.tags.erase(tag(1));
  exchanged.tags.erase(tag(2));
  const Image image = picture(kAllPlain, 1);
  MapTagTrial trial;
  trial.add(image.view(), find_tags(image.view(), finder, &kCamera)->detections, exchanged, kCamera,
            options.min_white_black_diff);
  const DoctorLine line = check_map_tags(trial, "");
  EXPECT_EQ(line.level, DoctorLevel::Warn);
  EXPECT_THAT(line.words, HasSubstr("do not tell where the camera is"));
}

}  // namespace
}  // namespace waymark
