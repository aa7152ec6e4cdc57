// Tests warnings about a map on a ring, using the true map with one defect at a time. Tests the reasons for
// rejected observations. Tests the loop-closure errors of odometry and of the map on a ring with ground
// truth. Tests warnings about a lap as a whole: the lens, tags on a line, times without a tag, and the camera
// mounting.
#include "waymark/mapping/lap/map_checks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/ring_drive.hpp"
#include "waymark/base/angles.hpp"

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

void expect_on_map_page(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) testing::expect_on_page("map", warning);
}

/// Moves a tag in the frames [from, to); the map rejects those observations.
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

TEST(MapCheck, IsEmptyForAGoodMap) {
  const RingDrive drive = drive_ring();
  EXPECT_THAT(check_map(drive.lap, true_map(drive)), IsEmpty());
  EXPECT_THAT(second_places(drive.lap, true_map(drive)), IsEmpty());
}

TEST(MapCheck, ReportsATagSizeInconsistentWithOdometryAndTheFittingSize) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  map.odometry_scales.distance = 1.25;
  EXPECT_THAT(check_map(drive.lap, map),
              ElementsAre(AllOf(HasSubstr("25 % farther"), HasSubstr("25 % too large"), HasSubstr("0.128 m"),
                                HasSubstr("0.160 m"))));
  expect_on_map_page(check_map(drive.lap, map));
  map.odometry_scales.distance = 0.8;
  EXPECT_THAT(check_map(drive.lap, map), ElementsAre(AllOf(HasSubstr("20 % less"), HasSubstr("too small"),
                                                           HasSubstr("0.200 m"), HasSubstr("0.160 m"))));
  map.odometry_scales_sigma.distance = 0.06;
  EXPECT_THAT(check_map(drive.lap, map), IsEmpty()) << "within four standard deviations";
  map.odometry_scales_sigma.distance = 0;
  EXPECT_THAT(check_map(drive.lap, map), IsEmpty()) << "no odometry";
  map.odometry_scales = {.distance = 1.07};
  map.odometry_scales_sigma.distance = 0.001;
  EXPECT_THAT(check_map(drive.lap, map), IsEmpty()) << "within the usual error of odometry";
}

TEST(MapCheck, ReportsWrongSizesAndTheirSpread) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  map.assumed_size_spread = 0.003;
  map.size_spread = 0.004;
  EXPECT_THAT(check_map(drive.lap, map), IsEmpty()) << "about as assumed";
  map.size_spread = 0.01;
  map.wrong_sizes = {{ring_tag(3), 0.16, 0.168, 0.0004, 12.5}};
  EXPECT_THAT(check_map(drive.lap, map),
              ElementsAre(AllOf(HasSubstr("tag36h11:3: its observations fit a side of 0.1680 +- 0.0004 m"),
                                HasSubstr("given 0.1600 m (12.5 sigma)")),
                          AllOf(HasSubstr("by 1.0 % (one sigma), assumed 0.3 %"))));
  expect_on_map_page(check_map(drive.lap, map));
}

TEST(MapCheck, ReportsMovedAndMissingTags) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  map.moved_tags = {{.tag = ring_tag(3),
                     .last_before_s = 4.2,
                     .first_after_s = 12.7,
                     .distance_m = 0.2,
                     .angle_rad = to_radians(5)}};
  map.missing_tags = {
      {.tag = ring_tag(4), .expected_images = 31, .passes = 2, .last_seen_s = 5.4},
      {.tag = ring_tag(5), .expected_images = 12, .passes = 1},
  };
  EXPECT_THAT(check_map(drive.lap, map),
              ElementsAre(AllOf(HasSubstr("tag36h11:3"), HasSubstr("0.200 m"), HasSubstr("5.0 deg"),
                                HasSubstr("4.2 s"), HasSubstr("12.7 s")),
                          AllOf(HasSubstr("tag36h11:4"), HasSubstr("31 images"), HasSubstr("5.4 s")),
                          AllOf(HasSubstr("tag36h11:5"), HasSubstr("12 images"))));
  expect_on_map_page(check_map(drive.lap, map));
  map.missing_tags.assign(6, {.tag = ring_tag(4), .expected_images = 31, .passes = 2});
  EXPECT_THAT(check_map(drive.lap, map), ::testing::SizeIs(2)) << "many missing tags have one cause";
  expect_on_map_page({check_map(drive.lap, map).back()});
}

TEST(MapCheck, AMovedTagHasNoSecondPlaceAndDoesNotCloseTheLoop) {
  const test::RingShape shape{.loops = 2};
  RingDrive drive = drive_ring(shape);
  BundleMap map;
  show_elsewhere(drive, shape, 5, {0.2, 0.15, 0}, drive.truth.size() / 2, drive.truth.size(), map);
  ASSERT_EQ(second_places(drive.lap, map).size(), 1U);
  for (int number = 0; number < 12; ++number) map.moved_tags.push_back({.tag = ring_tag(number)});
  EXPECT_THAT(second_places(drive.lap, map), IsEmpty());
  EXPECT_FALSE(loop_closure(drive.lap, map));
}

TEST(MapCheck, DistinguishesAMovedTagFromDuplicateTags) {
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
  EXPECT_THAT(check_map(drive.lap, map), Contains(AllOf(HasSubstr("tag36h11:5"), HasSubstr("0.25 m"),
                                                        HasSubstr("moved"), Not(HasSubstr("carry")))));
  expect_on_map_page(check_map(drive.lap, map));
}

TEST(MapCheck, ReportsADuplicateTagForALargeDistance) {
  const test::RingShape shape{.loops = 2};
  RingDrive drive = drive_ring(shape);
  BundleMap map;
  show_elsewhere(drive, shape, 5, {-0.9, -1.1, 0}, drive.truth.size() / 2, drive.truth.size(), map);
  EXPECT_THAT(check_map(drive.lap, map),
              Contains(AllOf(HasSubstr("tag36h11:5"), HasSubstr("two tags carry"))));
  expect_on_map_page(check_map(drive.lap, map));
}

TEST(MapCheck, FewDisplacedObservationsAreIgnored) {
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

TEST(MapCheck, ReportsTheCameraIfManyTagsAppearTwice) {
  const test::RingShape shape{.loops = 2};
  RingDrive drive = drive_ring(shape);
  BundleMap map;
  const std::size_t half = drive.truth.size() / 2;
  for (int number = 1; number < 7; ++number)
    show_elsewhere(drive, shape, number, {0.2, 0.15, 0}, half, drive.truth.size(), map);
  map = true_map(drive);
  for (int number = 1; number < 7; ++number)
    test::reject(drive, ring_tag(number), half, drive.truth.size(), map);
  const auto warnings = check_map(drive.lap, map);
  EXPECT_THAT(warnings, Contains(AllOf(HasSubstr("6 of 12"), HasSubstr("`waymark calibrate camera`"))));
  EXPECT_THAT(warnings, Not(Contains(HasSubstr("two places, "))));
  expect_on_map_page(warnings);
}

/// A drive on which some tags were elsewhere in the first half, and its map, which has their last places.
struct TagsMovedByHalf {
  RingDrive drive = drive_ring({.loops = 2});
  BundleMap map{};

  explicit TagsMovedByHalf(int first, int last) {
    const std::size_t half = drive.truth.size() / 2;
    for (int number = first; number <= last; ++number)
      show_elsewhere(drive, {.loops = 2}, number, {0.2, 0.15, 0}, 0, half, map);
    map = true_map(drive);
    for (int number = first; number <= last; ++number) test::reject(drive, ring_tag(number), 0, half, map);
  }
  [[nodiscard]] std::vector<MovedTag> moved_tags() const {
    return internal::tags_moved_in_view(second_places(drive.lap, map), map);
  }
};

TEST(MapCheck, ManyTagsInTwoPlacesAreNotMovedTags) {
  EXPECT_THAT(TagsMovedByHalf(1, 4).moved_tags(), ::testing::SizeIs(4));
  TagsMovedByHalf many(1, 6);
  EXPECT_THAT(many.moved_tags(), IsEmpty());
  const auto warnings = check_map(many.drive.lap, many.map);
  EXPECT_THAT(warnings, Contains(AllOf(HasSubstr("6 of 12"), HasSubstr("`waymark calibrate camera`"))));
  EXPECT_THAT(warnings, Not(Contains(HasSubstr("two places, "))));
  expect_on_map_page(warnings);
  TagsMovedByHalf some(1, 3);
  some.map.moved_tags = {{.tag = ring_tag(9)}, {.tag = ring_tag(10)}};
  EXPECT_THAT(some.moved_tags(), IsEmpty()) << "the search already found others";
  EXPECT_THAT(check_map(some.drive.lap, some.map), Contains(HasSubstr("5 of 12")));
  EXPECT_THAT(check_map(some.drive.lap, some.map), Not(Contains(HasSubstr("moved by"))));
}

TEST(MapCheck, AnAnchorInTwoPlacesIsReportedAsSuch) {
  const TagsMovedByHalf of_anchor(0, 0);
  EXPECT_THAT(of_anchor.moved_tags(), IsEmpty()) << "its given pose applies to the earlier place";
  const auto places = second_places(of_anchor.drive.lap, of_anchor.map);
  ASSERT_EQ(places.size(), 1U);
  EXPECT_EQ(places[0].tag, ring_tag(0));
  EXPECT_TRUE(places[0].one_after_the_other);
}

TEST(MapCheck, ASmallShareIsAPlaceIfItWasExcludedBeforeTheSearch) {
  const test::RingShape shape{.loops = 2, .frame_m = 0.0125};
  RingDrive drive = drive_ring(shape);
  std::size_t end = drive.truth.size();
  const auto shows = [&](std::size_t f) {
    return std::ranges::count(drive.lap.frames[f].detections, ring_tag(5), &TagDetection::tag) > 0;
  };
  while (!shows(end - 1)) --end;
  BundleMap map;
  show_elsewhere(drive, shape, 5, {-0.2, -0.15, 0}, end - 8, end, map);  // remains in view
  ASSERT_EQ(map.rejected.size(), 8U);
  const auto places = second_places(drive.lap, map);
  ASSERT_EQ(places.size(), 1U);
  EXPECT_LT(places[0].there, 0.05 * (places[0].here + places[0].there));
  EXPECT_TRUE(places[0].one_after_the_other);
  for (RejectedObservation& observation : map.rejected) observation.chi2 = 1e6;
  EXPECT_THAT(second_places(drive.lap, map), IsEmpty()) << "detection errors";
}

TEST(MapCheck, ReportsTagsWithFewObservationsOrALargeSigma) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  map.observations.at(ring_tag(4)) = 1;
  map.map.tags.at(ring_tag(7)).covariance = Matrix6(0.01 * Matrix6::Identity());
  const auto warnings = check_map(drive.lap, map);
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_THAT(warnings[0], AllOf(HasSubstr("tag36h11:4"), HasSubstr("1 observation ")));
  EXPECT_THAT(warnings[1], AllOf(HasSubstr("tag36h11:7"), HasSubstr("observations ")));
  expect_on_map_page(warnings);
  RingDrive extended = drive;
  extended.lap.prior = LapPrior{.map = drive.tags};
  EXPECT_EQ(check_map(extended.lap, map).size(), 1U) << "a tag of the extended map may have few observations";
}

TEST(MapCheck, ReportsPartsThatDependOnFewObservationsOnce) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  const TagId anchor = drive.lap.anchor;
  map.observations.at(anchor) = 1;
  TagCut others{.by = {anchor}, .observations = 1};
  for (const auto& [id, tag] : map.map.tags) {
    if (id != anchor) others.beyond.push_back(id);
  }
  map.thin_cuts = {others};
  const auto warnings = check_map(drive.lap, map);
  ASSERT_EQ(warnings.size(), 1U) << "the few observations of the anchor are the same cause";
  EXPECT_THAT(warnings[0], AllOf(HasSubstr("one observation"), HasSubstr(to_string(anchor))));
  expect_on_map_page(warnings);
  map.observations.at(ring_tag(4)) = 2;
  map.thin_cuts = {{{ring_tag(4)}, {ring_tag(4)}, 2, {}}};
  map.observations.at(anchor) = 40;
  EXPECT_THAT(check_map(drive.lap, map), ElementsAre(AllOf(HasSubstr("tag36h11:4"), HasSubstr("2 obs"))));
  map.observations.at(ring_tag(4)) = 40;
  map.thin_cuts = {{{ring_tag(4), ring_tag(5)}, {ring_tag(6)}, 3, 0.12}};
  EXPECT_THAT(check_map(drive.lap, map),
              ElementsAre(AllOf(HasSubstr("tag36h11:4, tag36h11:5"), HasSubstr("0.12 m"))));
  expect_on_map_page(check_map(drive.lap, map));
}

TEST(MapCheck, ReportsTagsThatAreNotInTheMap) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  map.unconnected = {ring_tag(40)};
  map.unconfirmed = {ring_tag(50)};
  EXPECT_THAT(check_map(drive.lap, map),
              ElementsAre(HasSubstr("tag36h11:40"), AllOf(HasSubstr("tag36h11:50"), HasSubstr("misread"))));
  expect_on_map_page(check_map(drive.lap, map));
  map.unconnected.clear();
  for (int number = 51; number < 58; ++number) map.unconfirmed.push_back(ring_tag(number));
  EXPECT_THAT(check_map(drive.lap, map),
              ElementsAre(AllOf(HasSubstr("tag36h11:54 and 3 more"), Not(HasSubstr("tag36h11:55")))));
  expect_on_map_page(check_map(drive.lap, map));
}

TEST(MapCheck, IncludesWarningsAboutThePriorMap) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  map.prior_warnings = {"a warning"};
  EXPECT_THAT(check_map(drive.lap, map), ElementsAre("a warning"));
}

constexpr std::size_t kFrame = 40;

/// The first detection in a frame.
TagDetection& seen_in(RingDrive& drive, std::size_t frame = kFrame) {
  return drive.lap.frames[frame].detections.front();
}

RejectionCounts counts_of(const RingDrive& drive, const TagId& tag) {
  BundleMap map = true_map(drive);
  test::reject(drive, tag, kFrame, kFrame + 1, map);
  return rejections_by_tag(drive.lap, map).at(tag);
}

TEST(LeftOut, AnObservationNearItsTagHasInexactCorners) {
  RingDrive drive = drive_ring();
  EXPECT_EQ(counts_of(drive, seen_in(drive).tag), (RejectionCounts{0, 0, 1, 0}));
}

TEST(LeftOut, AnotherTagWithThisIdIsElsewhere) {
  RingDrive drive = drive_ring();
  auto& detections = drive.lap.frames[kFrame].detections;
  ASSERT_GE(detections.size(), 2U);
  std::swap(detections[0].tag, detections[1].tag);
  EXPECT_EQ(counts_of(drive, detections[0].tag), (RejectionCounts{1, 0, 0, 0}));
}

TEST(LeftOut, AnIdThatIsNotInTheMapIsElsewhere) {
  RingDrive drive = drive_ring();
  seen_in(drive).tag = ring_tag(99);
  EXPECT_EQ(counts_of(drive, ring_tag(99)), (RejectionCounts{1, 0, 0, 0}));
}

TEST(LeftOut, DegenerateCornersAndUnplacedFramesGiveNoPose) {
  RingDrive drive = drive_ring();
  TagDetection& seen = seen_in(drive);
  seen.corners_px[1] = seen.corners_px[2] = seen.corners_px[0];
  EXPECT_EQ(counts_of(drive, seen.tag), (RejectionCounts{0, 0, 0, 1}));
  RingDrive lost = drive_ring();
  BundleMap map = true_map(lost);
  test::reject(lost, seen_in(lost).tag, kFrame, kFrame + 1, map);
  map.trajectory.erase(map.trajectory.begin() + kFrame);
  EXPECT_EQ(rejections_by_tag(lost.lap, map).at(seen_in(lost).tag), (RejectionCounts{0, 0, 0, 1}));
}

TEST(LeftOut, DistinguishesTheOtherPoseFromAMovedTag) {
  RingDrive drive = drive_ring();
  const TagId tag = seen_in(drive).tag;
  BundleMap map = true_map(drive);
  // The map contains the tag's pose mirrored about the line of sight.
  const SE3 map_T_cam = drive.truth[kFrame].map_T_base * drive.lap.base_T_cam;
  const SE3 cam_T_tag = map_T_cam.inverse() * drive.tags.tags.at(tag).map_T_tag;
  const auto observed = observe(drive.lap.frames[kFrame], drive.lap);
  const auto of_tag = std::ranges::find(observed.tags, tag, &TagPoseObservation::tag);
  ASSERT_NE(of_tag, observed.tags.end());
  ASSERT_TRUE(of_tag->other) << "the camera is too close for two poses";
  EXPECT_LT((of_tag->cam_T_tag.translation() - cam_T_tag.translation()).norm(), 0.01);
  map.map.tags.at(tag).map_T_tag = map_T_cam * of_tag->other->cam_T_tag;
  test::reject(drive, tag, kFrame, kFrame + 1, map);
  const RejectionCounts counts = rejections_by_tag(drive.lap, map).at(tag);
  EXPECT_EQ(counts[static_cast<std::size_t>(RejectionReason::OtherPose)], 1);
}

TEST(LeftOut, ForADuplicateIdInAFrameTheWorseOneIsRejected) {
  RingDrive drive = drive_ring();
  auto& detections = drive.lap.frames[kFrame].detections;
  ASSERT_GE(detections.size(), 2U);
  detections[1].tag = detections[0].tag;
  BundleMap map = true_map(drive);
  map.rejected.push_back({drive.lap.frames[kFrame].stamp, detections[0].tag, 1e6});
  EXPECT_EQ(rejections_by_tag(drive.lap, map).at(detections[0].tag), (RejectionCounts{1, 0, 0, 0}));
}

TEST(LeftOut, EveryReasonHasAName) {
  const std::vector<std::string> warnings = {"elsewhere", "other_pose", "inexact_corners", "no_pose"};
  for (std::size_t i = 0; i < kRejectionReasons; ++i)
    EXPECT_EQ(to_string(static_cast<RejectionReason>(i)), warnings[i]);
}

TEST(LeftOut, ManyAreReportedWithTheTagsThatHaveMost) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  int all = 0;
  for (const auto& [id, count] : map.observations) all += count;
  std::vector<std::string> warnings;
  internal::check_observations(drive.lap, map, warnings);
  EXPECT_THAT(warnings, IsEmpty());
  test::reject(drive, ring_tag(3), 0, drive.lap.frames.size(), map);
  const auto rejected = map.rejected.size();
  ASSERT_GT(static_cast<double>(rejected), 0.03 * all);
  internal::check_observations(drive.lap, map, warnings);
  const std::string count = std::to_string(rejected);
  EXPECT_THAT(warnings,
              ElementsAre(AllOf(HasSubstr(count + " of " + std::to_string(all)),
                                HasSubstr("tag36h11:3 (" + count + " of " + count + ": " + count))));
  expect_on_map_page(warnings);
  warnings.clear();
  internal::check_observations({.camera = test::ring_camera()}, {}, warnings);
  EXPECT_THAT(warnings, IsEmpty());
}

TEST(LoopClosure, IsZeroForExactOdometryAndAnExactMap) {
  const RingDrive drive = drive_ring();
  const auto loop = loop_closure(drive.lap, true_map(drive));
  ASSERT_TRUE(loop);
  EXPECT_GT(loop->away_s, 10);
  EXPECT_NEAR(loop->way_m, 0.5 * loop->away_s, 0.01) << "one frame for every 0.1 s and 5 cm";
  EXPECT_LT(loop->before_m, 1e-6);
  EXPECT_LT(loop->before_rad, 1e-6);
  EXPECT_LT(loop->after_m, 1e-4);
}

TEST(LoopClosure, IncludesAWrongDistanceScale) {
  const RingDrive drive = drive_ring({.odometry_distance = 0.9});
  const auto loop = loop_closure(drive.lap, true_map(drive));
  ASSERT_TRUE(loop);
  // The arc has the same angle but nine tenths of the radius, so the chord is a tenth shorter.
  const double turned_rad = loop->way_m;
  EXPECT_NEAR(loop->before_m, 0.1 * 2 * std::abs(std::sin(turned_rad / 2)), 1e-3);
  EXPECT_LT(loop->before_rad, 1e-6);
}

TEST(LoopClosure, IncludesAWrongYawScale) {
  const RingDrive drive = drive_ring({.odometry_yaw = 0.98});
  const auto loop = loop_closure(drive.lap, true_map(drive));
  ASSERT_TRUE(loop);
  EXPECT_NEAR(loop->before_rad, 0.02 * loop->way_m, 1e-4) << "radius 1 m; chords are shorter than arcs";
  EXPECT_GT(loop->before_m, 0.01);
}

TEST(LoopClosure, ReportsATrajectoryThatDoesNotCloseInTheMap) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  const auto closed = loop_closure(drive.lap, map);
  ASSERT_TRUE(closed);
  const SE3 aside({}, {0.03, -0.04, 0});
  for (StampedPose& pose : map.trajectory) {
    if (to_seconds(pose.stamp - map.trajectory.front().stamp) > 6) pose.map_T_base = aside * pose.map_T_base;
  }
  const auto loop = loop_closure(drive.lap, map);
  ASSERT_TRUE(loop);
  EXPECT_EQ(loop->tag, closed->tag);
  EXPECT_NEAR(loop->after_m, 0.05, 1e-3);
}

TEST(LoopClosure, TheFrameOfTheMapDoesNotMatter) {
  const RingDrive drive = drive_ring({.odometry_distance = 0.97, .odometry_yaw = 1.01});
  BundleMap moved = true_map(drive);
  const SE3 by(SO3::from_rpy(0, 0, 2), {5, -3, 0});
  for (auto& [id, tag] : moved.map.tags) tag.map_T_tag = by * tag.map_T_tag;
  for (StampedPose& pose : moved.trajectory) pose.map_T_base = by * pose.map_T_base;
  const auto here = loop_closure(drive.lap, true_map(drive));
  const auto there = loop_closure(drive.lap, moved);
  ASSERT_TRUE(here && there);
  EXPECT_EQ(here->tag, there->tag);
  EXPECT_NEAR(here->before_m, there->before_m, 1e-9);
  EXPECT_NEAR(here->before_rad, there->before_rad, 1e-9);
  EXPECT_NEAR(here->after_m, there->after_m, 1e-6);
}

TEST(LoopClosure, IgnoresRejectedObservations) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  const auto loop = loop_closure(drive.lap, map);
  ASSERT_TRUE(loop);
  test::reject(drive, loop->tag, 100, drive.lap.frames.size(), map);
  const auto another = loop_closure(drive.lap, map);
  if (another) {
    EXPECT_NE(another->tag, loop->tag);
  }
  for (int number = 0; number < 12; ++number) map.map.tags.erase(ring_tag(number));
  EXPECT_FALSE(loop_closure(drive.lap, map)) << "only tags in the map count";
}

TEST(LoopClosure, IsEmptyWithoutAClosedLoop) {
  const RingDrive open = drive_ring({.loops = 0.5});
  EXPECT_FALSE(loop_closure(open.lap, true_map(open)));
  RingDrive drive = drive_ring();
  drive.lap.odometry.clear();
  EXPECT_FALSE(loop_closure(drive.lap, true_map(drive))) << "odometry is required";
  EXPECT_FALSE(loop_closure({.camera = test::ring_camera()}, {}));
}

}  // namespace
}  // namespace waymark

namespace waymark::internal {
namespace {

using Warnings = std::vector<std::string>;

Warnings region_warnings(const BundleMap& map) {
  Warnings warnings;
  check_regions(map, warnings);
  return warnings;
}

TEST(CheckRegions, ReportsThePartWithTheLargestDisplacement) {
  BundleMap map;
  map.regions[2] = {.corners = 100, .mean_px = {-0.5, 0.25}, .rms_px = 0.7};
  map.regions[6] = {.corners = 100, .mean_px = {0.3, 0}, .rms_px = 0.3};
  // Projected minus measured is (-0.5, 0.25): the corners are observed to the right of and above their
  // predicted positions.
  EXPECT_THAT(region_warnings(map),
              ElementsAre(AllOf(HasSubstr("upper right"), HasSubstr("(+0.50, -0.25) px"))));
  testing::expect_on_page("map", region_warnings(map).front());
  map.regions[2].corners = 39;
  EXPECT_THAT(region_warnings(map), ElementsAre(HasSubstr("lower left"))) << "too few corners";
  map.regions[6].rms_px = 0.7;
  EXPECT_THAT(region_warnings(map), IsEmpty()) << "displaced in all directions";
}

TEST(CheckRegions, EveryPartHasAName) {
  const Warnings names = {"upper left", "top",        "upper right", "left",       "middle",
                          "right",      "lower left", "bottom",      "lower right"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    BundleMap map;
    map.regions[i] = {.corners = 50, .mean_px = {1, 0}, .rms_px = 1};
    EXPECT_THAT(region_warnings(map), ElementsAre(HasSubstr("the " + names[i] + " of")));
  }
}

TEST(CheckRegions, ReportsLargeCornerErrorsEverywhere) {
  BundleMap map{.noise_ratio = 4};
  EXPECT_THAT(region_warnings(map), ElementsAre(HasSubstr("4 times")));
  testing::expect_on_page("map", region_warnings(map).front());
  map.noise_ratio = 3;
  EXPECT_THAT(region_warnings(map), IsEmpty());
}

Warnings line_warnings(const std::vector<Eigen::Vector3d>& places) {
  BundleMap map;
  int number = 0;
  for (const Eigen::Vector3d& place : places)
    map.map.tags[ring_tag(number++)] = {.map_T_tag = SE3({}, place)};
  Warnings warnings;
  check_line(map, warnings);
  return warnings;
}

TEST(CheckLine, ReportsTagsOnALineInAnyDirection) {
  Random random(3);
  for (int round = 0; round < 10; ++round) {
    const Eigen::Vector3d along =
        Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    const Eigen::Vector3d from(random.normal(), random.normal(), random.normal());
    std::vector<Eigen::Vector3d> places;
    for (int i = 0; i < 5; ++i) places.emplace_back(from + 0.7 * i * along);
    ASSERT_EQ(line_warnings(places).size(), 1U);
    if (round == 0) testing::expect_on_page("map", line_warnings(places).front());
    const Eigen::Vector3d across = along.unitOrthogonal();
    places[2] += 0.5 * across;
    EXPECT_THAT(line_warnings(places), IsEmpty()) << "one tag is not on the line";
  }
}

TEST(CheckLine, TwoTagsAreNotReported) {
  EXPECT_THAT(line_warnings({{0, 0, 0}, {1, 0, 0}}), IsEmpty());
  EXPECT_THAT(line_warnings({}), IsEmpty());
}

Warnings blindness(const LapInput& lap, const BundleMap& map) {
  Warnings warnings;
  check_blindness(lap, map, warnings);
  return warnings;
}

TEST(CheckBlindness, ReportsTheLongestTimeWithoutAMappedTag) {
  test::RingDrive drive = test::drive_ring();
  const BundleMap map = test::true_map(drive);
  EXPECT_THAT(blindness(drive.lap, map), IsEmpty());
  for (std::size_t f = 20; f < 45; ++f) drive.lap.frames[f].detections.clear();
  for (std::size_t f = 60; f < 100; ++f) drive.lap.frames[f].detections.clear();
  EXPECT_THAT(blindness(drive.lap, map), ElementsAre(AllOf(HasSubstr("4.1 s"), HasSubstr("5.9 s"))));
  testing::expect_on_page("map", blindness(drive.lap, map).front());
  for (std::size_t f = 62; f < 100; f += 15)
    drive.lap.frames[f].detections.push_back({.tag = ring_tag(77), .corners_px = {}});
  EXPECT_THAT(blindness(drive.lap, map), ElementsAre(HasSubstr("4.1 s"))) << "77 is not in the map";
}

TEST(CheckBlindness, RejectedObservationsDoNotCount) {
  test::RingDrive drive = test::drive_ring();
  BundleMap map = test::true_map(drive);
  for (int number = 0; number < 12; ++number) test::reject(drive, ring_tag(number), 30, 60, map);
  EXPECT_THAT(blindness(drive.lap, map), ElementsAre(AllOf(HasSubstr("3.1 s"), HasSubstr("2.9 s"))));
  for (TagFrame& frame : drive.lap.frames) frame.detections.clear();
  EXPECT_THAT(blindness(drive.lap, map), IsEmpty()) << "a lap without observations is reported elsewhere";
  drive.lap.frames.clear();
  EXPECT_THAT(blindness(drive.lap, map), IsEmpty());
}

MountingEstimate mounting() {
  MountingEstimate estimate{.camera = test::ring_camera()};
  estimate.off << 0.024, 0.001, 0, to_radians(0.1), to_radians(-2), to_radians(1);
  estimate.sigma << 0.004, 0.004, 1e-4, to_radians(0.3), to_radians(0.2), to_radians(0.6);
  estimate.out = {true, false, false, false, true, false};
  estimate.unobservable = {false, false, true, false, false, false};
  return estimate;
}

Warnings mounting_warnings(const BundleMap& map) {
  Warnings warnings;
  check_mounting(map, warnings);
  return warnings;
}

TEST(CheckMounting, ReportsSignificantOffsets) {
  BundleMap map;
  EXPECT_THAT(mounting_warnings(map), IsEmpty()) << "no estimate";
  map.mounting = mounting();
  EXPECT_THAT(mounting_warnings(map),
              ElementsAre(AllOf(HasSubstr("+24 mm forward (+- 8)"), HasSubstr("-2.0 deg downwards (+- 0.4)"),
                                Not(HasSubstr("to the left")), Not(HasSubstr("axis")),
                                HasSubstr("`waymark calibrate robot`"))));
  testing::expect_on_page("map", mounting_warnings(map).front());
  map.mounting->out = {};
  EXPECT_THAT(mounting_warnings(map), IsEmpty()) << "no significant offset";
}

TEST(CheckMounting, ListsUnobservableParametersIfTheEstimateIsUsed) {
  BundleMap map{.mounting = mounting(), .mounting_used = true};
  EXPECT_THAT(mounting_warnings(map),
              ElementsAre(HasSubstr("robot.yaml"),
                          AllOf(HasSubstr("determine the height of"), Not(HasSubstr("yaw")))));
  for (const std::string& warning : mounting_warnings(map)) testing::expect_on_page("map", warning);
  map.mounting->unobservable[0] = map.mounting->unobservable[5] = true;
  EXPECT_THAT(mounting_warnings(map), ElementsAre(Not(HasSubstr("mm forward")),
                                                  HasSubstr("the forward position, the height, the yaw of")));
}

}  // namespace
}  // namespace waymark::internal
