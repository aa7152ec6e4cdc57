// What a person is told of a map before trusting it: a ring whose map is the truth, one thing spoiled at a
// time.
#include "waymark/mapping/lap/map_checks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"

namespace waymark {
namespace {

using test::drive_ring;
using test::ring_tag;
using test::RingDrive;
using test::true_map;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// Shows a tag elsewhere from one frame to before another; the map leaves those observations out.
void show_elsewhere(RingDrive& drive, const test::RingShape& shape, int number, const Eigen::Vector3d& by,
                    std::size_t from, std::size_t to, BundleMap& map) {
  RingDrive moved = drive;
  SE3& place = moved.tags.tags.at(ring_tag(number)).map_T_tag;
  place = SE3(SO3(), by) * place;
  Random random(9);
  for (std::size_t f = from; f < to; ++f) {
    const TagFrame other = test::ring_frame(moved, shape, {"cam", drive.lap.camera, drive.lap.base_T_cam},
                                            drive.truth[f], random);
    auto& seen = drive.lap.frames[f].detections;
    std::erase_if(seen, [&](const TagDetection& d) { return d.tag == ring_tag(number); });
    for (const TagDetection& detection : other.detections) {
      if (detection.tag == ring_tag(number)) seen.push_back(detection);
    }
  }
  map = true_map(drive);
  test::reject(drive, ring_tag(number), from, to, map);
}

TEST(MapCheck, AGoodMapNeedsNoWord) {
  const RingDrive drive = drive_ring();
  EXPECT_THAT(check_map(drive.lap, true_map(drive)), IsEmpty());
  EXPECT_THAT(second_places(drive.lap, true_map(drive)), IsEmpty());
}

TEST(MapCheck, ASizeThatContradictsTheWheelsIsNamedWithTheSizeThatFits) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  map.odometry_scales.distance = 1.25;
  EXPECT_THAT(check_map(drive.lap, map),
              ElementsAre(AllOf(HasSubstr("25 % farther"), HasSubstr("25 % too large"),
                                HasSubstr("is it 0.128 m instead of 0.160 m?"))));
  map.odometry_scales.distance = 0.8;
  EXPECT_THAT(check_map(drive.lap, map), ElementsAre(AllOf(HasSubstr("20 % less far"), HasSubstr("too small"),
                                                           HasSubstr("0.200 m instead of 0.160 m"))));
  map.odometry_scales_sigma.distance = 0.06;
  EXPECT_THAT(check_map(drive.lap, map), IsEmpty()) << "within four standard deviations";
  map.odometry_scales_sigma.distance = 0;
  EXPECT_THAT(check_map(drive.lap, map), IsEmpty()) << "no odometry";
  map.odometry_scales = {.distance = 1.07};
  map.odometry_scales_sigma.distance = 0.001;
  EXPECT_THAT(check_map(drive.lap, map), IsEmpty()) << "wheels differ by as much";
}

TEST(MapCheck, ATagThatWasMovedHalfwayIsToldFromTwoTagsOfOneId) {
  const test::RingShape shape{.loops = 2};
  RingDrive drive = drive_ring(shape);
  const std::size_t half = drive.truth.size() / 2;
  BundleMap map;
  show_elsewhere(drive, shape, 5, {0.2, 0.15, 0}, half, drive.truth.size(), map);
  const auto places = second_places(drive.lap, map);
  ASSERT_EQ(places.size(), 1U);
  EXPECT_EQ(places[0].tag, ring_tag(5));
  EXPECT_NEAR(places[0].distance_m, 0.25, 0.01);
  EXPECT_TRUE(places[0].one_after_the_other);
  EXPECT_FALSE(places[0].at_once);
  EXPECT_EQ(places[0].here, map.observations.at(ring_tag(5)));
  EXPECT_LT((places[0].map_T_tag.translation() -
             (drive.tags.tags.at(ring_tag(5)).map_T_tag.translation() + Eigen::Vector3d(0.2, 0.15, 0)))
                .norm(),
            0.01);
  EXPECT_THAT(check_map(drive.lap, map),
              Contains(AllOf(HasSubstr("tag36h11:5 was seen in two places, 0.25 m apart"),
                             HasSubstr("moved during the lap"))));
}

TEST(MapCheck, AnIdThatIsFarAwayLaterWasCarriedOrIsThereTwice) {
  const test::RingShape shape{.loops = 2};
  RingDrive drive = drive_ring(shape);
  BundleMap map;
  show_elsewhere(drive, shape, 5, {-0.9, -1.1, 0}, drive.truth.size() / 2, drive.truth.size(), map);
  EXPECT_THAT(check_map(drive.lap, map),
              Contains(HasSubstr("two tags carry this id (or it was carried there)")));
}

TEST(MapCheck, AFewObservationsElsewhereAreErrorsOfThePictures) {
  const test::RingShape shape{.loops = 2};
  RingDrive drive = drive_ring(shape);
  std::size_t first = 0;
  const auto shows = [&](std::size_t f) {
    return std::ranges::count(drive.lap.frames[f].detections, ring_tag(5), &TagDetection::tag) > 0;
  };
  while (!shows(first)) ++first;
  BundleMap map;
  show_elsewhere(drive, shape, 5, {0.2, 0.15, 0}, first, first + 3, map);
  EXPECT_THAT(second_places(drive.lap, map), IsEmpty()) << "three";
}

TEST(MapCheck, WhereManyTagsStandTwiceItIsTheCamera) {
  const test::RingShape shape{.loops = 2};
  RingDrive drive = drive_ring(shape);
  BundleMap map;
  const std::size_t half = drive.truth.size() / 2;
  for (int number = 1; number < 7; ++number)
    show_elsewhere(drive, shape, number, {0.2, 0.15, 0}, half, drive.truth.size(), map);
  map = true_map(drive);
  for (int number = 1; number < 7; ++number)
    test::reject(drive, ring_tag(number), half, drive.truth.size(), map);
  const auto words = check_map(drive.lap, map);
  EXPECT_THAT(words, Contains(HasSubstr("6 of 12 tags seem to stand in two places")));
  EXPECT_THAT(words, Not(Contains(HasSubstr("was seen in two places"))));
}

TEST(MapCheck, ATagThatHangsOnLittleOrIsKnownBadlyIsNamed) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  map.observations.at(ring_tag(4)) = 1;
  map.map.tags.at(ring_tag(7)).covariance = Matrix6(0.01 * Matrix6::Identity());
  const auto words = check_map(drive.lap, map);
  ASSERT_EQ(words.size(), 2U);
  EXPECT_THAT(words[0], AllOf(HasSubstr("tag36h11:4 hangs on 1 view of at most"), Not(HasSubstr("views"))));
  EXPECT_THAT(words[1], HasSubstr("tag36h11:7 hangs on "));
  RingDrive extended = drive;
  extended.lap.prior = LapPrior{.map = drive.tags};
  EXPECT_EQ(check_map(extended.lap, map).size(), 1U)
      << "a tag of the map that is extended need not be seen often";
}

TEST(MapCheck, WhatIsNotInTheMapIsNamed) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  map.unconnected = {ring_tag(40)};
  map.unconfirmed = {ring_tag(50)};
  EXPECT_THAT(check_map(drive.lap, map),
              ElementsAre(HasSubstr("tag36h11:40 was never seen together"),
                          AllOf(HasSubstr("tag36h11:50: no observation of it is confirmed"))));
  map.unconnected.clear();
  for (int number = 51; number < 58; ++number) map.unconfirmed.push_back(ring_tag(number));
  EXPECT_THAT(check_map(drive.lap, map),
              ElementsAre(AllOf(HasSubstr("tag36h11:54 and 3 more"), HasSubstr("no observation of them"),
                                Not(HasSubstr("tag36h11:55")))));
}

TEST(MapCheck, WhatChangedSinceThePriorMapIsPassedOn) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  map.prior_words = {"tag36h11:3 stands elsewhere"};
  EXPECT_THAT(check_map(drive.lap, map), ElementsAre("tag36h11:3 stands elsewhere"));
}

}  // namespace
}  // namespace waymark
