// What is said of a lap as a whole: the lens, a line of tags, times without a tag, the camera's place.
#include "waymark/mapping/lap/lap_diagnosis.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"
#include "waymark/base/angles.hpp"

namespace waymark::internal {
namespace {

using test::ring_tag;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using Words = std::vector<std::string>;

Words regions_words(const BundleMap& map) {
  Words words;
  check_regions(map, words);
  return words;
}

TEST(CheckRegions, NamesThePartThatIsOffMostAndWhereItsCornersAre) {
  BundleMap map;
  map.regions[2] = {.corners = 100, .mean_px = {-0.5, 0.25}, .rms_px = 0.7};
  map.regions[6] = {.corners = 100, .mean_px = {0.3, 0}, .rms_px = 0.3};
  // Projected less measured is (-0.5, 0.25): the corners are seen to the right of, and above, where they
  // should be.
  EXPECT_THAT(regions_words(map),
              ElementsAre(AllOf(HasSubstr("in the upper right"), HasSubstr("(+0.50, -0.25) px"))));
  map.regions[2].corners = 39;
  EXPECT_THAT(regions_words(map), ElementsAre(HasSubstr("in the lower left"))) << "few corners tell nothing";
  map.regions[6].rms_px = 0.7;
  EXPECT_THAT(regions_words(map), IsEmpty()) << "off to all sides, not in one direction";
}

TEST(CheckRegions, EveryPartHasItsName) {
  const Words names = {"upper left", "top",        "upper right", "left",       "middle",
                       "right",      "lower left", "bottom",      "lower right"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    BundleMap map;
    map.regions[i] = {.corners = 50, .mean_px = {1, 0}, .rms_px = 1};
    EXPECT_THAT(regions_words(map), ElementsAre(HasSubstr("in the " + names[i] + " of the picture")));
  }
}

TEST(CheckRegions, CornersThatAreWorseEverywhereAreNamed) {
  BundleMap map{.noise_ratio = 4};
  EXPECT_THAT(regions_words(map), ElementsAre(HasSubstr("4 times less exact than the detector says")));
  map.noise_ratio = 3;
  EXPECT_THAT(regions_words(map), IsEmpty());
}

Words line_words(const std::vector<Eigen::Vector3d>& places) {
  BundleMap map;
  int number = 0;
  for (const Eigen::Vector3d& place : places)
    map.map.tags[ring_tag(number++)] = {.map_T_tag = SE3({}, place)};
  Words words;
  check_line(map, words);
  return words;
}

TEST(CheckLine, TagsOnALineInAnyDirectionAreNamed) {
  Random random(3);
  for (int round = 0; round < 10; ++round) {
    const Eigen::Vector3d along =
        Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    const Eigen::Vector3d from(random.normal(), random.normal(), random.normal());
    std::vector<Eigen::Vector3d> places;
    for (int i = 0; i < 5; ++i) places.emplace_back(from + 0.7 * i * along);
    EXPECT_EQ(line_words(places).size(), 1U);
    const Eigen::Vector3d across = along.unitOrthogonal();
    places[2] += 0.5 * across;
    EXPECT_THAT(line_words(places), IsEmpty()) << "one stands aside";
  }
}

TEST(CheckLine, TwoTagsAreNoLineToSpeakOf) {
  EXPECT_THAT(line_words({{0, 0, 0}, {1, 0, 0}}), IsEmpty());
  EXPECT_THAT(line_words({}), IsEmpty());
}

Words blindness(const LapInput& lap, const BundleMap& map) {
  Words words;
  check_blindness(lap, map, words);
  return words;
}

TEST(CheckBlindness, TheLongestTimeWithoutAMappedTagIsNamed) {
  test::RingDrive drive = test::drive_ring();
  const BundleMap map = test::true_map(drive);
  EXPECT_THAT(blindness(drive.lap, map), IsEmpty());
  for (std::size_t f = 20; f < 45; ++f) drive.lap.frames[f].detections.clear();
  for (std::size_t f = 60; f < 100; ++f) drive.lap.frames[f].detections.clear();
  EXPECT_THAT(blindness(drive.lap, map), ElementsAre(HasSubstr("for 4.1 s from 5.9 s on")));
  for (std::size_t f = 62; f < 100; f += 15)
    drive.lap.frames[f].detections.push_back({.tag = ring_tag(77), .corners_px = {}});
  EXPECT_THAT(blindness(drive.lap, map), ElementsAre(HasSubstr("for 4.1 s"))) << "77 is not in the map";
}

TEST(CheckBlindness, WhatTheMapLeavesOutWasNotSeen) {
  test::RingDrive drive = test::drive_ring();
  BundleMap map = test::true_map(drive);
  for (int number = 0; number < 12; ++number) test::reject(drive, ring_tag(number), 30, 60, map);
  EXPECT_THAT(blindness(drive.lap, map), ElementsAre(HasSubstr("for 3.1 s from 2.9 s on")));
  for (TagFrame& frame : drive.lap.frames) frame.detections.clear();
  EXPECT_THAT(blindness(drive.lap, map), IsEmpty()) << "nothing seen at all is said elsewhere";
  drive.lap.frames.clear();
  EXPECT_THAT(blindness(drive.lap, map), IsEmpty());
}

MountingEstimate mounting() {
  MountingEstimate estimate{.camera = test::ring_camera()};
  estimate.off << 0.024, 0.001, 0, to_radians(0.1), to_radians(-2), to_radians(1);
  estimate.sigma << 0.004, 0.004, 1e-4, to_radians(0.3), to_radians(0.2), to_radians(0.6);
  estimate.out = {true, false, false, false, true, false};
  estimate.untold = {false, false, true, false, false, false};
  return estimate;
}

Words mounting_words(const BundleMap& map) {
  Words words;
  check_mounting(map, words);
  return words;
}

TEST(CheckMounting, SaysWhatIsOffByMoreThanChance) {
  BundleMap map;
  EXPECT_THAT(mounting_words(map), IsEmpty()) << "nobody looked";
  map.mounting = mounting();
  EXPECT_THAT(mounting_words(map),
              ElementsAre(AllOf(HasSubstr("+24 mm forward (+- 8)"), HasSubstr("-2.0 deg downwards (+- 0.4)"),
                                Not(HasSubstr("to the left")), Not(HasSubstr("ahead")),
                                HasSubstr("it was not taken into account"))));
  map.mounting->out = {};
  EXPECT_THAT(mounting_words(map), IsEmpty()) << "nothing stands out";
}

TEST(CheckMounting, WhereItIsUsedWhatTheLapDoesNotTellIsListed) {
  BundleMap map{.mounting = mounting(), .mounting_used = true};
  EXPECT_THAT(mounting_words(map),
              ElementsAre(HasSubstr("taken into account, here and in the robot.yaml"),
                          AllOf(HasSubstr("does not tell how high:"), Not(HasSubstr("its yaw")))));
  map.mounting->untold[0] = map.mounting->untold[5] = true;
  EXPECT_THAT(mounting_words(map),
              ElementsAre(Not(HasSubstr("mm forward")), HasSubstr("how far forward, how high, its yaw:")));
}

}  // namespace
}  // namespace waymark::internal
