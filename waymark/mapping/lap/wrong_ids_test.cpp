// Tests that ids in two places are detected from odometry alone on a drive along a wall. The unconfirmed
// observations of a lap must be those of misread ids only. Maps made from laps with misread ids must be as
// accurate as those made without them, and rejected ids must be reported. WAYMARK_FULL=1 runs 10 seeds.
#include "waymark/mapping/lap/wrong_ids.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"
#include "tests/support/warehouse.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/lap/map_checks.hpp"

namespace waymark {
namespace {

constexpr int kFrames = 900;
constexpr double kStep_m = 0.02;
constexpr double kSight_m = 1.5;

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

CameraModel lens() {
  return CameraModel::make(PinholeRadtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 4}, 640,
                           480)
      .value();
}

/// A drive of 9 m along x and back, past a tag every half metre. Individual poses have errors of a
/// centimetre.
struct Drive {
  LapInput lap{.camera = lens()};
  std::vector<ObservedFrame> observed{};
  Random random{3};

  Drive() {
    for (int f = 0; f < kFrames; ++f) {
      const SensorTime stamp{std::chrono::milliseconds(66 * f)};
      const double x = kStep_m * (f < kFrames / 2 ? f : kFrames - f);
      lap.odometry.push_back({.stamp = stamp, .odom_T_base = SE2(x, 0, 0)});
      lap.frames.push_back({.stamp = stamp});
      observed.push_back({.stamp = stamp});
    }
    for (int number = 0; number < 18; ++number) {
      const Eigen::Vector2d place(0.5 * number, 1);
      for (int f = 0; f < kFrames; ++f) see(f, tag(number), place);
    }
  }

  double x_of(int frame) const { return lap.odometry[static_cast<std::size_t>(frame)].odom_T_base.x(); }

  /// Adds an observation if the tag is in view.
  void see(int frame, const TagId& which, const Eigen::Vector2d& place) {
    const auto f = static_cast<std::size_t>(frame);
    if (std::abs(x_of(frame) - place.x()) > kSight_m) return;
    const Eigen::Vector3d odom_p(place.x() + 0.01 * random.normal(), place.y() + 0.01 * random.normal(), 0.3);
    lap.frames[f].detections.push_back({.tag = which, .corners_px = {}});
    observed[f].tags.push_back(
        {.tag = which, .cam_T_tag = lift(lap.odometry[f].odom_T_base).inverse() * SE3({}, odom_p)});
  }

  /// Displaces the observations of a tag in the frames [from, to).
  void move(const TagId& which, int from, int to, const Eigen::Vector2d& by) {
    for (int f = from; f < to; ++f) {
      for (TagPoseObservation& seen : observed[static_cast<std::size_t>(f)].tags) {
        if (seen.tag == which) seen.cam_T_tag = SE3({}, Eigen::Vector3d(by.x(), by.y(), 0)) * seen.cam_T_tag;
      }
    }
  }

  /// Removes all tags except these.
  void keep_only(const std::set<TagId>& tags) {
    for (std::size_t f = 0; f < observed.size(); ++f) {
      std::erase_if(observed[f].tags, [&](const TagPoseObservation& s) { return !tags.contains(s.tag); });
      std::erase_if(lap.frames[f].detections, [&](const TagDetection& s) { return !tags.contains(s.tag); });
    }
  }

  void rename(const TagId& from, const TagId& to) {
    for (std::size_t f = 0; f < observed.size(); ++f) {
      for (TagPoseObservation& seen : observed[f].tags) seen.tag = seen.tag == from ? to : seen.tag;
      for (TagDetection& seen : lap.frames[f].detections) seen.tag = seen.tag == from ? to : seen.tag;
    }
  }

  std::vector<internal::ObservationIndex> second() const {
    return internal::observations_of_duplicate_tags(lap, observed);
  }
  int observations(const TagId& which, int from = 0, int to = kFrames) const {
    int count = 0;
    for (int f = from; f < to; ++f)
      count += static_cast<int>(
          std::ranges::count(lap.frames[static_cast<std::size_t>(f)].detections, which, &TagDetection::tag));
    return count;
  }
};

TEST(DuplicateTags, FixedTagsHaveNone) {
  EXPECT_TRUE(Drive().second().empty());
  Drive without_wheels;
  without_wheels.lap.odometry.clear();
  EXPECT_TRUE(without_wheels.second().empty());
}

TEST(DuplicateTags, TwoTagsWithOneIdInAlternation) {
  Drive drive;
  const int copies = drive.observations(tag(6));
  drive.rename(tag(6), tag(5));  // the tags are half a metre apart
  const auto second = drive.second();
  EXPECT_NEAR(static_cast<double>(second.size()), copies, 0.05 * copies);
  const int all = drive.observations(tag(5));
  const internal::ExcludedObservations excluded(drive.lap, second);
  int left = 0;
  for (const TagFrame& frame : drive.lap.frames) {
    const auto here = std::ranges::count(frame.detections, tag(5), &TagDetection::tag);
    EXPECT_LE(here, 1);
    left += static_cast<int>(here);
  }
  EXPECT_EQ(left + static_cast<int>(second.size()), all);
}

TEST(ExcludedObservations, AreRestoredAtTheirIndices) {
  Drive drive;
  const LapInput whole = drive.lap;
  std::vector<internal::ObservationIndex> some;
  std::size_t all = 0;
  for (std::size_t f = 0; f < whole.frames.size(); ++f) {
    for (std::size_t d = 0; d < whole.frames[f].detections.size(); ++d, ++all) {
      if ((f + d) % 3 != 0) some.push_back({f, d});
    }
  }
  const auto count = [&] {
    std::size_t detections = 0;
    for (const TagFrame& frame : drive.lap.frames) detections += frame.detections.size();
    return detections;
  };
  const TagDetection* storage = drive.lap.frames.front().detections.data();
  {
    const internal::ExcludedObservations excluded(drive.lap, some);
    EXPECT_EQ(count(), all - some.size());
  }
  EXPECT_EQ(drive.lap.frames.front().detections.data(), storage);
  ASSERT_EQ(count(), all);
  for (std::size_t f = 0; f < whole.frames.size(); ++f)
    EXPECT_TRUE(std::ranges::equal(drive.lap.frames[f].detections, whole.frames[f].detections, {},
                                   &TagDetection::tag, &TagDetection::tag))
        << f;
}

TEST(DuplicateTags, ATagMovedInView) {
  Drive drive;
  const int moment = 200;  // the tag is visible from 125 to 275 on the outward drive
  drive.move(tag(8), moment, kFrames, {0.1, 0.08});
  const auto second = drive.second();
  EXPECT_EQ(static_cast<int>(second.size()), drive.observations(tag(8), 0, moment))
      << "those before the move";
  EXPECT_TRUE(std::ranges::all_of(second, [&](const auto& index) { return index.frame < 200; }));
}

/// The excluded observations are those of the tag in the frames [from, to).
void expect_excluded(const Drive& drive, const TagId& which, int from, int to) {
  const auto second = drive.second();
  EXPECT_EQ(static_cast<int>(second.size()), drive.observations(which, from, to));
  for (const auto& [frame, detection] : second) {
    EXPECT_GE(static_cast<int>(frame), from);
    EXPECT_LT(static_cast<int>(frame), to);
    EXPECT_EQ(drive.lap.frames[frame].detections[detection].tag, which);
  }
}

// Tag 8 is visible in frames 125 to 275 on the outward drive, and 625 to 775 on the way back.
TEST(DuplicateTags, AnAnchorMovedInViewRemainsAtItsFirstPlace) {
  for (const int moment : {200, 700}) {
    SCOPED_TRACE(moment);
    Drive drive;
    drive.lap.anchor = tag(8);
    drive.move(tag(8), moment, kFrames, {0.2, 0.15});
    expect_excluded(drive, tag(8), moment, kFrames);
  }
}

TEST(DuplicateTags, ATagMovedTwiceInViewRemainsAtItsLastPlace) {
  for (const int second : {670, 700}) {  // less and more than half a metre after the first move
    SCOPED_TRACE(second);
    Drive drive;
    drive.move(tag(8), 650, kFrames, {0.2, 0.15});
    drive.move(tag(8), second, kFrames, {0.24, 0.18});
    expect_excluded(drive, tag(8), 0, second);
    drive.lap.anchor = tag(8);
    expect_excluded(drive, tag(8), 650, kFrames);
  }
}

TEST(DuplicateTags, ATagMovedAndPutBackInView) {
  Drive drive;
  drive.move(tag(8), 660, 700, {0.2, 0.15});
  expect_excluded(drive, tag(8), 660, 700);
  drive.lap.anchor = tag(8);
  expect_excluded(drive, tag(8), 660, 700);
}

TEST(DuplicateTags, AFewObservationsDoNotReplaceAllOthers) {
  Drive last;
  last.move(tag(8), 767, kFrames, {0.24, 0.18});
  expect_excluded(last, tag(8), 767, kFrames);
  Drive more;
  more.move(tag(8), 750, kFrames, {0.24, 0.18});
  expect_excluded(more, tag(8), 0, 750);
  Drive first;
  first.lap.anchor = tag(8);
  first.move(tag(8), 0, 134, {0.24, 0.18});
  expect_excluded(first, tag(8), 0, 134);
}

TEST(DuplicateTags, IfAllTagsJumpItIsOdometry) {
  Drive drive;
  for (int number = 0; number < 18; ++number) drive.move(tag(number), 200, kFrames, {0.25, 0.1});
  EXPECT_TRUE(drive.second().empty());
}

TEST(DuplicateTags, OneStationaryTagShowsThatOdometryIsRight) {
  Drive alone;
  alone.keep_only({tag(8)});
  alone.move(tag(8), 200, kFrames, {0.2, 0.15});
  EXPECT_TRUE(alone.second().empty()) << "the tag or odometry";
  Drive both;
  both.keep_only({tag(8), tag(9)});
  both.move(tag(8), 200, kFrames, {0.2, 0.15});
  expect_excluded(both, tag(8), 0, 200);
  both.move(tag(9), 200, kFrames, {0.2, 0.15});
  EXPECT_TRUE(both.second().empty()) << "an error of odometry";
}

TEST(DuplicateTags, ATagThatIsDisplacedLessDoesNotShowThatOdometryIsRight) {
  Drive drive;
  drive.keep_only({tag(8), tag(11)});
  drive.move(tag(11), 215, kFrames, {0.144, 0.108});
  expect_excluded(drive, tag(11), 0, 215);
  drive.move(tag(8), 215, kFrames, {0.072, 0.054});  // no jump, because the pose errors are almost as large
  EXPECT_TRUE(drive.second().empty()) << "odometry turned the wrong way, and tag 8 is nearer";
}

TEST(DuplicateTags, DistantPlacesCountIfOdometryFindsOtherTagsAgain) {
  Drive drive;
  const int fewer = std::min(drive.observations(tag(1)), drive.observations(tag(16)));
  drive.rename(tag(16), tag(1));
  EXPECT_EQ(static_cast<int>(drive.second().size()), fewer);
  Drive slipping;  // all tags are displaced on the way back
  for (int number = 0; number < 18; ++number) slipping.move(tag(number), kFrames / 2 + 80, kFrames, {0, 6});
  EXPECT_LT(slipping.second().size(), 100U);
}

TEST(DuplicateTags, MisreadIdsHaveNoSite) {
  Drive drive;
  for (std::size_t f = 0; f < drive.observed.size(); ++f) {
    for (std::size_t d = 0; d < drive.observed[f].tags.size(); ++d) {
      if (drive.random.uniform(0, 1) > 0.05) continue;
      const TagId misread = tag(static_cast<int>(drive.random.uniform(0, 17.99)));
      drive.observed[f].tags[d].tag = drive.lap.frames[f].detections[d].tag = misread;
    }
  }
  EXPECT_TRUE(drive.second().empty());
}

}  // namespace
}  // namespace waymark

namespace waymark::internal {
namespace {

using test::drive_ring;
using test::observed_frames;
using test::ring_tag;
using test::RingDrive;
using ::testing::IsEmpty;

std::vector<ObservationIndex> unconfirmed(const RingDrive& drive) {
  return unconfirmed_observations(drive.lap, observed_frames(drive.lap));
}

/// Replaces the ids of a share of the detections with ids of other tags on the ring, and returns these
/// detections.
std::set<ObservationIndex> misread(RingDrive& drive, double share, std::uint64_t seed) {
  Random random(seed);
  std::set<ObservationIndex> wrong;
  for (std::size_t f = 0; f < drive.lap.frames.size(); ++f) {
    auto& detections = drive.lap.frames[f].detections;
    for (std::size_t d = 0; d < detections.size(); ++d) {
      if (random.uniform() >= share) continue;
      const int number = (detections[d].tag.number + 3 + static_cast<int>(random.index(6))) % 12;
      if (std::ranges::count(detections, ring_tag(number), &TagDetection::tag) > 0) continue;
      detections[d].tag = ring_tag(number);
      wrong.insert({f, d});
    }
  }
  return wrong;
}

TEST(LapConfirmation, CorrectIdsAreConfirmed) {
  EXPECT_THAT(unconfirmed(drive_ring({.stated_sigma_px = 0.1, .noise_px = 0.1})), IsEmpty());
  EXPECT_THAT(unconfirmed(drive_ring({.rear = true})), IsEmpty());
}

TEST(LapConfirmation, OnlyMisreadIdsAreUnconfirmed) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RingDrive drive = drive_ring({.stated_sigma_px = 0.1, .noise_px = 0.1, .seed = seed});
    const std::set<ObservationIndex> wrong = misread(drive, 0.03, seed);
    ASSERT_GE(wrong.size(), 4U);
    const auto found = unconfirmed(drive);
    EXPECT_TRUE(std::ranges::is_sorted(found)) << "sorted";
    for (const ObservationIndex& index : found)
      EXPECT_TRUE(wrong.contains(index)) << seed << ": frame " << index.frame;
    EXPECT_GE(static_cast<double>(found.size()), 0.8 * static_cast<double>(wrong.size())) << seed;
  }
}

TEST(LapConfirmation, NeighboursInTheImageConfirmWithoutOdometry) {
  RingDrive drive = drive_ring({.stated_sigma_px = 0.1, .noise_px = 0.1});
  const std::set<ObservationIndex> wrong = misread(drive, 0.03, 4);
  drive.lap.odometry.clear();
  const auto found = unconfirmed(drive);
  std::size_t right = 0;
  for (const ObservationIndex& index : found) {
    if (wrong.contains(index)) continue;
    ++right;
    const bool beside = std::ranges::any_of(wrong, [&](const auto& w) { return w.frame == index.frame; });
    EXPECT_TRUE(beside) << "a correct id is unconfirmed only next to a wrong one: frame " << index.frame;
  }
  EXPECT_GE(static_cast<double>(found.size() - right), 0.6 * static_cast<double>(wrong.size()));
}

TEST(LapConfirmation, AnIdObservedOnceAmongOthersIsUnconfirmed) {
  RingDrive drive = drive_ring();
  auto& detections = drive.lap.frames[40].detections;
  ASSERT_GE(detections.size(), 2U);
  detections[1].tag = ring_tag(300);
  EXPECT_EQ(unconfirmed(drive), (std::vector<ObservationIndex>{{40, 1}}));
}

TEST(LapConfirmation, DetectionsWithoutAPoseDoNotShiftTheOthers) {
  RingDrive drive = drive_ring();
  auto& detections = drive.lap.frames[40].detections;
  ASSERT_GE(detections.size(), 2U);
  detections[0].corners_px[1] = detections[0].corners_px[2] = detections[0].corners_px[0];
  detections[1].tag = ring_tag(300);
  EXPECT_EQ(unconfirmed(drive), (std::vector<ObservationIndex>{{40, 1}}));
}

TEST(LapConfirmation, IsEmptyForAnEmptyLap) {
  EXPECT_THAT(unconfirmed_observations({.camera = test::ring_camera()}, {}), IsEmpty());
}

}  // namespace
}  // namespace waymark::internal

namespace waymark {
namespace {

struct LapErrors {
  double mean_m = 0, worst_m = 0;
  std::size_t tags = 0;
  double seconds = 0;
};

/// A lap past this many tags, with odometry.
test::Warehouse lap_past(int tags, int seed) {
  return test::drive_warehouse(
      {.tags = tags, .frame_m = 0.0395, .farthest_m = 5.9, .seed = static_cast<std::uint64_t>(seed)});
}

/// Replaces the ids of this share of the detections with other ids from the map or arbitrary ids from the
/// family.
std::size_t misread(LapInput& lap, int ids, double share, int seed) {
  constexpr std::uint64_t kFamily = 48000;
  Random random(static_cast<std::uint64_t>(seed));
  std::size_t wrong = 0;
  for (TagFrame& frame : lap.frames) {
    for (TagDetection& detection : frame.detections) {
      if (random.uniform() >= share) continue;
      const bool of_the_map = random.uniform() < 0.5;
      const std::uint64_t off = 1 + random.index(static_cast<std::uint64_t>(ids) - 1);
      const std::uint64_t any = random.index(kFamily);
      detection.tag.number =
          static_cast<int>(of_the_map ? (static_cast<std::uint64_t>(detection.tag.number) + off) %
                                            static_cast<std::uint64_t>(ids)
                                      : any);
      ++wrong;
    }
  }
  return wrong;
}

struct LapOutcome {
  LapErrors of{};
  std::size_t absent = 0;  ///< number of tags in the map that do not exist
  std::vector<std::string> warnings{};
};

LapOutcome mapped(const test::Warehouse& house) {
  const auto start = std::chrono::steady_clock::now();
  const auto map = map_by_bundle(house.lap);
  EXPECT_TRUE(map) << to_string(map.error());
  if (!map) return {};
  LapOutcome outcome{.warnings = check_map(house.lap, *map)};
  for (const auto& [id, tag] : map->map.tags) {
    const MappedTag* truth = house.truth.find(id);
    if (truth == nullptr) {
      ++outcome.absent;
      continue;
    }
    const double off = (tag.map_T_tag.translation() - truth->map_T_tag.translation()).norm();
    outcome.of.mean_m += off;
    outcome.of.worst_m = std::max(outcome.of.worst_m, off);
    ++outcome.of.tags;
  }
  outcome.of.mean_m /= static_cast<double>(std::max<std::size_t>(outcome.of.tags, 1));
  outcome.of.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return outcome;
}

TEST(WrongIds, LapsAreMappedAsAccuratelyAsWithoutThem) {
  const bool full = std::getenv("WAYMARK_FULL") != nullptr;
  const int tags = full ? 520 : 40;
  for (int seed = 1; seed <= (full ? 10 : 1); ++seed) {
    const test::Warehouse clean = lap_past(tags, seed);
    const LapErrors reference = mapped(clean).of;
    EXPECT_EQ(reference.tags, static_cast<std::size_t>(tags));
    std::printf("seed %d: %zu detections in %zu frames, clean %.3f m (worst %.3f), %zu tags, %.2f s\n", seed,
                clean.detections, clean.lap.frames.size(), reference.mean_m, reference.worst_m,
                reference.tags, reference.seconds);
    for (double share : full ? std::vector{0.0005, 0.005, 0.02} : std::vector{0.02}) {
      test::Warehouse altered = clean;
      const std::size_t wrong = misread(altered.lap, tags, share, 1000 + seed);
      const auto [outcome, absent, warnings] = mapped(altered);
      std::printf("  %zu wrong ids: %.3f m (worst %.3f), %zu tags and %zu that do not exist, %.2f s\n", wrong,
                  outcome.mean_m, outcome.worst_m, outcome.tags, absent, outcome.seconds);
      EXPECT_LT(outcome.mean_m, 1.5 * reference.mean_m) << "seed " << seed << ", share " << share;
      EXPECT_GE(static_cast<double>(outcome.tags), (share > 0.01 ? 0.90 : 0.98) * tags) << seed;
      EXPECT_EQ(absent, 0U) << "seed " << seed << ", share " << share;
      EXPECT_THAT(warnings, ::testing::Contains(::testing::HasSubstr("misread"))) << seed;
    }
  }
}
}  // namespace
}  // namespace waymark
