// One thing wrong with a lap of circuit24, which tag and how drawn by the seed: found, named, and nothing
// else accused. A few seeds, among them those at which an earlier version failed; all of 1 to 24 with
// WAYMARK_FULL=1.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <numeric>

#include <gmock/gmock.h>

#include "tests/support/circuit_lap.hpp"
#include "waymark/base/random.hpp"
#include "waymark/mapping/lap/map_comparison.hpp"

namespace waymark {
namespace {

using namespace test;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kUnharmed_m = 0.05;
constexpr double kAsClean_m = 0.01;

std::vector<int> seeds(std::vector<int> few) {
  if (std::getenv("WAYMARK_FULL") == nullptr) return few;
  std::vector<int> all(24);
  std::iota(all.begin(), all.end(), 1);
  for (const int seed : few) {
    if (seed > 24) all.push_back(seed);
  }
  return all;
}

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

SE3 place_of(const TagId& which) { return circuit().tags.find(which)->map_T_tag; }

/// What a seed has in store: a tag that is no anchor, and how it is moved, 10 to 25 cm.
struct Fate {
  Random random;
  TagId which{};
  Eigen::Vector3d by = Eigen::Vector3d::Zero();

  explicit Fate(int seed) : random(static_cast<std::uint64_t>(31 * seed + 7)) {
    which = some_tag();
    const double angle = random.uniform(0, 2 * std::numbers::pi);
    const double length = random.uniform(0.1, 0.25);
    by = {length * std::cos(angle), length * std::sin(angle), 0};
  }
  TagId some_tag() { return tag(1 + std::min(22, static_cast<int>(random.uniform(0, 23)))); }
  /// Two tags of which the first then carries the id of both.
  std::pair<TagId, TagId> pair_apart(double least_m, double most_m) {
    while (true) {
      const TagId a = some_tag();
      const TagId b = some_tag();
      const double apart = (place_of(a).translation() - place_of(b).translation()).norm();
      if (a != b && apart >= least_m && apart < most_m) return {a, b};
    }
  }
};

/// What a detector would have seen had the tag stood elsewhere from then on: corners shifted as its centre
/// is.
void move_tag(Lap& lap, const TagId& moved, SensorTime from, const Eigen::Vector3d& by) {
  const SE3 map_T_before = place_of(moved);
  const SE3 map_T_after = SE3(SO3(), by) * map_T_before;
  for (TagFrame& frame : lap.input.frames) {
    const auto truth = true_pose(lap, frame.stamp);
    if (frame.stamp < from || !truth) continue;
    const SE3 cam_T_map = (*truth * lap.input.base_T_cam).inverse();
    for (TagDetection& detection : frame.detections) {
      if (detection.tag != moved) continue;
      const auto before =
          visible_corners(lap.input.camera, cam_T_map * map_T_before, 0.16, {.margin_px = -1e4});
      const auto after =
          visible_corners(lap.input.camera, cam_T_map * map_T_after, 0.16, {.margin_px = -1e4});
      for (std::size_t c = 0; before && after && c < 4; ++c)
        detection.corners_px[c] += (*after)[c] - (*before)[c];
    }
  }
}

std::vector<SensorTime> observations_of(const Lap& lap, const TagId& which) {
  std::vector<SensorTime> stamps;
  for (const TagFrame& frame : lap.input.frames) {
    if (std::ranges::find(frame.detections, which, &TagDetection::tag) != frame.detections.end())
      stamps.push_back(frame.stamp);
  }
  return stamps;
}

/// The tags that the words accuse of being somewhere else.
std::vector<std::string> in_two_places(const std::vector<std::string>& words) {
  std::vector<std::string> accused;
  for (const std::string& word : words) {
    if (word.find("seen in two places") != std::string::npos) accused.push_back(word);
  }
  return accused;
}

Lap drive_seed(int seed) { return drive(static_cast<std::uint64_t>(seed)); }

class ACleanLap : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, ACleanLap, ::testing::ValuesIn(seeds({1, 12, 47})));
TEST_P(ACleanLap, IsNotComplainedAbout) {
  const Lap lap = drive_seed(GetParam());
  const BundleMap map = map_of(lap.input);
  EXPECT_THAT(check_map(lap.input, map), IsEmpty());
  EXPECT_LT(map.rejected.size(), 12U);
}

class ATagMovedInView : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, ATagMovedInView, ::testing::ValuesIn(seeds({5, 8, 9, 17, 22})));
TEST_P(ATagMovedInView, IsNamed) {
  Lap lap = drive_seed(GetParam());
  const Fate fate(GetParam());
  const std::vector<SensorTime> seen = observations_of(lap, fate.which);
  move_tag(lap, fate.which, seen[seen.size() / 2], fate.by);
  const BundleMap map = map_of(lap.input);
  EXPECT_THAT(in_two_places(check_map(lap.input, map)),
              ElementsAre(AllOf(HasSubstr(to_string(fate.which) + " was"), HasSubstr("it was moved"))));
  EXPECT_LT(worst_of_others(map, {fate.which}), kUnharmed_m);
}

class ATagMovedBetweenPasses : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, ATagMovedBetweenPasses, ::testing::ValuesIn(seeds({10, 15, 18, 26, 39})));
TEST_P(ATagMovedBetweenPasses, IsNamed) {
  Lap lap = drive_seed(GetParam());
  const TagId other = tag(GetParam() % 3 == 0 ? 2 : GetParam() % 3 == 1 ? 1 : 3);  // at the start, and again
  move_tag(lap, other, lap.input.frames[lap.input.frames.size() / 2].stamp, Fate(GetParam()).by);
  const BundleMap map = map_of(lap.input);
  EXPECT_THAT(in_two_places(check_map(lap.input, map)),
              ElementsAre(AllOf(HasSubstr(to_string(other) + " was"), HasSubstr("it was moved"))));
  EXPECT_LT(worst_of_others(map, {other}), kUnharmed_m);
}

/// Which of the two a lap meets first, and how it drives between them, must not matter.
void expect_two_of_one_id(int seed, double least_m, double most_m) {
  Lap lap = drive_seed(seed);
  const auto [real, copy] = Fate(seed).pair_apart(least_m, most_m);
  for (TagFrame& frame : lap.input.frames) {
    for (TagDetection& detection : frame.detections) {
      if (detection.tag == copy) detection.tag = real;
    }
  }
  const BundleMap map = map_of(lap.input);
  EXPECT_THAT(in_two_places(check_map(lap.input, map)),
              ElementsAre(AllOf(HasSubstr(to_string(real) + " was"), HasSubstr("two tags carry this id"))));
  EXPECT_LT(worst_of_others(map, {real}), kUnharmed_m);
}

class TwoTagsOfOneId : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, TwoTagsOfOneId, ::testing::ValuesIn(seeds({1, 4, 5, 7, 16})));
TEST_P(TwoTagsOfOneId, CloseToEachOtherAreNamed) { expect_two_of_one_id(GetParam(), 0, 2); }
TEST_P(TwoTagsOfOneId, FarFromEachOtherAreNamed) { expect_two_of_one_id(GetParam(), 2, 10); }

class WrongIds : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, WrongIds, ::testing::ValuesIn(seeds({6, 15, 37})));
TEST_P(WrongIds, AreLeftOutAndNothingElse) {
  const Lap clean = drive_seed(GetParam());
  Lap lap = clean;
  Random random(static_cast<std::uint64_t>(60 + GetParam()));
  int wrong = 0;
  for (TagFrame& frame : lap.input.frames) {
    for (TagDetection& detection : frame.detections) {
      if (random.uniform(0, 1) > 0.05) continue;
      const TagId read = tag(static_cast<int>(random.uniform(0, 23.99)));
      wrong += read != detection.tag ? 1 : 0;
      detection.tag = read;
    }
  }
  const BundleMap map = map_of(lap.input);
  EXPECT_GT(static_cast<double>(map.rejected.size()), 0.8 * wrong);
  EXPECT_LT(static_cast<double>(map.rejected.size()), 1.4 * wrong);
  EXPECT_LT(worst_of_others(map, {}), worst_of_others(map_of(clean.input), {}) + kAsClean_m);
  EXPECT_THAT(check_map(lap.input, map),
              ElementsAre(AllOf(HasSubstr("contradict the others"),
                                HasSubstr("put the tag elsewhere (a wrong id, or it was moved)"))));
}

class AWrongTagSize : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, AWrongTagSize, ::testing::ValuesIn(seeds({2, 11})));
TEST_P(AWrongTagSize, ContradictsTheWheels) {
  Lap lap = drive_seed(GetParam());
  lap.input.sizes.default_size_m = 0.20;
  EXPECT_THAT(check_map(lap.input, map_of(lap.input)),
              ElementsAre(AllOf(HasSubstr("tag sizes look 2"), HasSubstr("% too large (is it 0.16"))));
}

class APriorMap : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, APriorMap, ::testing::ValuesIn(seeds({1, 9})));
TEST_P(APriorMap, IsHeldAgainstTheLap) {
  const Fate fate(GetParam());
  const TagMap prior = map_of(drive_seed(5000 + GetParam()).input).map;
  Lap lap = drive_seed(GetParam());
  const TagMap map = map_of(lap.input).map;
  const auto words = [&](const std::function<void(TagMap&)>& change) {
    TagMap changed = prior;
    change(changed);
    return describe(compare_maps(map, changed).value());
  };
  EXPECT_THAT(words([](TagMap&) {}), IsEmpty());
  const auto [a, b] = Fate(GetParam()).pair_apart(0, 10);
  EXPECT_THAT(words([&](TagMap& m) { std::swap(m.tags.at(a).map_T_tag, m.tags.at(b).map_T_tag); }),
              ElementsAre(to_string(std::min(a, b)) + " and " + to_string(std::max(a, b)) +
                          " are swapped against the prior map"));
  EXPECT_THAT(words([&](TagMap& m) {
                SE3& place = m.tags.at(fate.which).map_T_tag;
                place = SE3(SO3(), fate.by) * place;
              }),
              ElementsAre(HasSubstr(to_string(fate.which) + " stands 0.")));
  EXPECT_THAT(words([&](TagMap& m) { m.tags.at(fate.which).size_m = 0.2; }),
              ElementsAre(to_string(fate.which) + " has another size than in the prior map"));
  lap.input.sizes.default_size_m = 0.2;
  const auto too_large = compare_maps(map_of(lap.input).map, prior);
  ASSERT_FALSE(too_large);
  EXPECT_THAT(to_string(too_large.error()), HasSubstr("the sizes of the tags differ"));
}

}  // namespace
}  // namespace waymark
