// Maps of scenes and laps in which some ids were misread: as good as without them, or what they carry is left
// out and named. The long run (50 seeds) with WAYMARK_FULL=1.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/tag_scenes.hpp"
#include "tests/support/warehouse.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/lap/map_checks.hpp"
#include "waymark/mapping/scene/scene_checks.hpp"
#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {
namespace {

using test::WideScene;

struct Outcome {
  double mean_m = 0, worst_m = 0;  ///< of the tags in the map, in the frame of the known one
  std::size_t tags = 0;
  double seconds = 0;
};

Outcome outcome_of(const WideScene& wide, const SceneMap& map) {
  Outcome outcome;
  for (std::size_t t = 0; t < map.scene.bodies[0].tags.size(); ++t) {
    const auto map_T_tag = map.map_T_tag(0, t);
    if (!map_T_tag) continue;
    const SE3& truth = wide.truth.at(map.scene.bodies[0].tags[t].id.number);
    const double off = (map_T_tag->translation() - truth.translation()).norm();
    outcome.mean_m += off;
    outcome.worst_m = std::max(outcome.worst_m, off);
    ++outcome.tags;
  }
  outcome.mean_m /= static_cast<double>(std::max<std::size_t>(outcome.tags, 1));
  return outcome;
}

Outcome mapped(const WideScene& wide, SceneMap* keep = nullptr) {
  const auto start = std::chrono::steady_clock::now();
  auto map = map_scene(wide.scene, wide.recording);
  EXPECT_TRUE(map) << to_string(map.error());
  if (!map) return {};
  Outcome outcome = outcome_of(wide, *map);
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (keep != nullptr) *keep = std::move(*map);
  return outcome;
}

TEST(WrongIds, AislesAreMappedAsWithoutThem) {
  const bool full = std::getenv("WAYMARK_FULL") != nullptr;
  const int seeds = full ? 50 : 1;
  constexpr int kTags = 520;
  for (int seed = 1; seed <= seeds; ++seed) {
    const WideScene clean = test::aisles(kTags, static_cast<std::uint64_t>(seed));
    const Outcome reference = mapped(clean);
    EXPECT_EQ(reference.tags, kTags);
    std::printf("seed %d: %zu detections in %zu frames, clean %.3f m (worst %.3f), %zu tags, %.2f s\n", seed,
                clean.detections, clean.recording.frames.size(), reference.mean_m, reference.worst_m,
                reference.tags, reference.seconds);
    for (double share : full ? std::vector{0.0005, 0.005, 0.02} : std::vector{0.005, 0.02}) {
      WideScene spoilt = clean;
      const std::size_t wrong =
          test::misread(spoilt.recording, kTags, share, 1000 + static_cast<std::uint64_t>(seed));
      const Outcome outcome = mapped(spoilt);
      std::printf("  %zu wrong ids: %.3f m (worst %.3f), %zu tags, %.2f s\n", wrong, outcome.mean_m,
                  outcome.worst_m, outcome.tags, outcome.seconds);
      EXPECT_GE(static_cast<double>(outcome.tags), (share > 0.01 ? 0.90 : 0.98) * kTags) << seed;
      EXPECT_LT(outcome.mean_m, 1.5 * reference.mean_m) << "seed " << seed << ", share " << share;
    }
  }
}

TEST(WrongIds, AMisreadIdCountsForTheTagThatIsThere) {
  const WideScene clean = test::aisles(120, 3);
  WideScene spoilt = clean;
  const std::size_t wrong = test::misread(spoilt.recording, 120, 0.02, 5);
  SceneMap map;
  mapped(spoilt, &map);
  EXPECT_GT(static_cast<double>(map.corrected_ids.size()), 0.85 * static_cast<double>(wrong));
  for (const CorrectedId& corrected : map.corrected_ids) {
    const auto& read = spoilt.recording.frames[corrected.frame].views[0].detections;
    const auto& is = clean.recording.frames[corrected.frame].views[0].detections;
    bool right = false;
    for (std::size_t d = 0; d < read.size(); ++d)
      right = right || (read[d].tag == corrected.read && is[d].tag == corrected.is);
    EXPECT_TRUE(right) << corrected.read.number << " for " << corrected.is.number;
  }
  EXPECT_THAT(scene_doubts(map), testing::Contains(testing::HasSubstr("count for the tag that is there")));
  SceneMap of_clean;
  mapped(clean, &of_clean);
  EXPECT_TRUE(of_clean.corrected_ids.empty());
}

/// A lap with wheels past so many signs.
test::Warehouse lap_past(int tags, int seed) {
  return test::drive_warehouse(
      {.tags = tags, .frame_m = 0.0395, .farthest_m = 5.9, .seed = static_cast<std::uint64_t>(seed)});
}

/// Replaces the id of this share of the detections, by another one of the map or by any of the family.
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
  Outcome of{};
  std::size_t absent = 0;  ///< tags in the map that stand nowhere
  std::vector<std::string> words{};
};

LapOutcome mapped(const test::Warehouse& house) {
  const auto start = std::chrono::steady_clock::now();
  const auto map = map_by_bundle(house.lap);
  EXPECT_TRUE(map) << to_string(map.error());
  if (!map) return {};
  LapOutcome outcome{.words = check_map(house.lap, *map)};
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

TEST(WrongIds, LapsWithWheelsAreMappedAsWithoutThem) {
  const bool full = std::getenv("WAYMARK_FULL") != nullptr;
  const int tags = full ? 520 : 40;
  for (int seed = 1; seed <= (full ? 10 : 1); ++seed) {
    const test::Warehouse clean = lap_past(tags, seed);
    const Outcome reference = mapped(clean).of;
    EXPECT_EQ(reference.tags, static_cast<std::size_t>(tags));
    std::printf("seed %d: %zu detections in %zu frames, clean %.3f m (worst %.3f), %zu tags, %.2f s\n", seed,
                clean.detections, clean.lap.frames.size(), reference.mean_m, reference.worst_m,
                reference.tags, reference.seconds);
    for (double share : full ? std::vector{0.0005, 0.005, 0.02} : std::vector{0.02}) {
      test::Warehouse spoilt = clean;
      const std::size_t wrong = misread(spoilt.lap, tags, share, 1000 + seed);
      const auto [outcome, absent, words] = mapped(spoilt);
      std::printf("  %zu wrong ids: %.3f m (worst %.3f), %zu tags and %zu that stand nowhere, %.2f s\n",
                  wrong, outcome.mean_m, outcome.worst_m, outcome.tags, absent, outcome.seconds);
      EXPECT_LT(outcome.mean_m, 1.5 * reference.mean_m) << "seed " << seed << ", share " << share;
      EXPECT_GE(static_cast<double>(outcome.tags), (share > 0.01 ? 0.90 : 0.98) * tags) << seed;
      EXPECT_EQ(absent, 0U) << "seed " << seed << ", share " << share;
      EXPECT_THAT(words, testing::Contains(testing::HasSubstr("is confirmed by another"))) << seed;
    }
  }
}

/// The same way walked with detections of all but a few tags between two parts taken out.
WideScene thinly_tied(int observations) {
  WideScene wide = test::aisles(60, 7);
  int left = observations;
  for (SceneFrame& frame : wide.recording.frames) {
    auto& seen = frame.views[0].detections;
    const bool both = std::ranges::any_of(seen, [](const TagDetection& d) { return d.tag.number <= 30; }) &&
                      std::ranges::any_of(seen, [](const TagDetection& d) { return d.tag.number > 30; });
    if (!both) continue;
    const bool tied =
        left > 0 && std::ranges::any_of(seen, [](const TagDetection& d) { return d.tag.number == 30; });
    left -= tied ? 1 : 0;
    std::erase_if(seen, [&](const TagDetection& d) { return tied ? d.tag.number < 30 : d.tag.number <= 30; });
  }
  return wide;
}

TEST(WrongIds, APartThatHangsOnTwoObservationsIsInTheMapAndNamed) {
  SceneMap map;
  EXPECT_EQ(mapped(thinly_tied(2), &map).tags, 60U);
  ASSERT_FALSE(map.thin_cuts.empty());
  EXPECT_EQ(map.thin_cuts[0].observations, 2);
  EXPECT_THAT(scene_doubts(map),
              testing::Contains(testing::HasSubstr("tags 31-59 hang on 2 observations of tag 30")));
}

TEST(WrongIds, APartThatHangsOnOneObservationIsLeftOutAndNamed) {
  SceneMap map;
  EXPECT_EQ(mapped(thinly_tied(1), &map).tags, 31U);
  ASSERT_EQ(map.left_out_cuts.size(), 1U);
  EXPECT_EQ(map.left_out_cuts[0].beyond.size(), 29U);
  EXPECT_THAT(scene_doubts(map),
              testing::Contains(testing::HasSubstr("tags 31-59 hang on one observation of tag 30")));
}

TEST(WrongIds, CovariancesOfWhatIsKeptHold) {
  WideScene spoilt = test::aisles(120, 3);
  test::misread(spoilt.recording, 120, 0.02, 5);
  SceneMap map;
  mapped(spoilt, &map);
  EXPECT_TRUE(map.undetermined.empty());
  double sum = 0;
  int count = 0;
  for (std::size_t t = 1; t < map.scene.bodies[0].tags.size(); ++t) {
    const auto map_T_tag = map.map_T_tag(0, t);
    if (!map_T_tag) continue;
    const Matrix6& P = map.covariance.poses[map.problem.tags[0][t]];
    const Vector6 e = minus(spoilt.truth.at(map.scene.bodies[0].tags[t].id.number), *map_T_tag);
    EXPECT_GT(P.diagonal().minCoeff(), 0);
    sum += e.dot(P.llt().solve(e));
    ++count;
  }
  ASSERT_GT(count, 108);
  // Errors of one draw are nearly one error: only far off would be wrong.
  EXPECT_GT(sum / count, 1.0);
  EXPECT_LT(sum / count, 16.0);
}

TEST(WrongIds, CovariancesOfALongMapHold) {
  const WideScene wide = test::aisles(320, 3);
  SceneMap map;
  mapped(wide, &map);
  EXPECT_TRUE(map.undetermined.empty());
  for (std::size_t t = 20; t < 320; t += 50) {
    const Matrix6& P = map.covariance.poses[map.problem.tags[0][t]];
    const Vector6 e = minus(wide.truth.at(map.scene.bodies[0].tags[t].id.number), *map.map_T_tag(0, t));
    EXPECT_GT(P.diagonal().minCoeff(), 0) << t;
    EXPECT_LT(e.dot(P.llt().solve(e)), 22.46) << t << ": 0.999 quantile of chi-square";
  }
}

/// Distances between these tags as they are, that good.
void measure(WideScene& wide, double sigma_m, const std::vector<std::pair<int, int>>& pairs) {
  for (const auto& [a, b] : pairs) {
    const double far = (wide.truth.at(a).translation() - wide.truth.at(b).translation()).norm();
    wide.scene.distances.push_back({a, b, -1, -1, far, sigma_m});
  }
}

TEST(GivenFacts, ADistanceFreesTheSizeOfTheTags) {
  WideScene wide = test::aisles(24, 4, 0.05);
  for (SceneBody& body : wide.scene.bodies) {
    body.default_tag_size_m *= 1.006;  // as somebody measured the print
    for (SceneTag& tag : body.tags) tag.size_m *= 1.006;
  }
  for (int id : {3, 20})
    wide.scene.bodies[0].tags.push_back({{FamilyId::TagStandard52h13, id}, 0.25 * 1.006, {}});
  measure(wide, 0.0005, {{3, 20}});
  SceneMap map;
  const Outcome outcome = mapped(wide, &map);
  EXPECT_NEAR(map.size_scale, 1 / 1.006, 0.0006);
  EXPECT_LT(outcome.mean_m, 0.01);  // 0.6 % of eight metres are 5 cm
  EXPECT_THAT(scene_doubts(map), testing::Not(testing::Contains(testing::HasSubstr("distance"))));
}

TEST(GivenFacts, OneOfManyDistancesThatIsWrongIsNamed) {
  WideScene wide = test::aisles(24, 4, 0.05);
  for (int id : {3, 9, 15, 20})
    wide.scene.bodies[0].tags.push_back({{FamilyId::TagStandard52h13, id}, 0.25, {}});
  measure(wide, 0.002, {{3, 9}, {9, 15}, {15, 20}, {3, 20}});
  wide.scene.distances[1].measured_m += 0.1;
  SceneMap map;
  mapped(wide, &map);
  EXPECT_THAT(scene_doubts(map), testing::Contains(testing::AllOf(testing::HasSubstr("between tags 9 and 15"),
                                                                  testing::HasSubstr("sigma"))));
}

TEST(GivenFacts, APriorThatHardlyKnowsTheTurnLeadsToAMap) {
  WideScene wide = test::aisles(24, 6);
  wide.scene.bodies[0].tags[0].body_T_tag =
      ScenePrior::of(wide.truth.at(0), Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(1.0));
  const Outcome outcome = mapped(wide);
  EXPECT_EQ(outcome.tags, 24U);
  EXPECT_LT(outcome.mean_m, 0.1);
}

TEST(GivenFacts, AKnownTagThatStandsElsewhereIsNamed) {
  WideScene wide = test::aisles(24, 8);
  const auto give = [&](int id, const Eigen::Vector3d& off) {
    const SE3 mean(wide.truth.at(id).rotation(), wide.truth.at(id).translation() + off);
    wide.scene.bodies[0].tags.push_back(
        {{FamilyId::TagStandard52h13, id},
         0.25,
         ScenePrior::of(mean, Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(1e-3))});
  };
  give(1, {0, 0, 0});
  give(2, {0, 0, 0});
  give(12, {0.4, 0, 0});
  SceneMap map;
  mapped(wide, &map);
  EXPECT_THAT(scene_doubts(map), testing::Contains(testing::HasSubstr("tag 12 ")));
}

TEST(GivenFacts, TheOnlyKnownTagIsNamedWhenItsSizeIsWrong) {
  WideScene wide = test::aisles(24, 8);
  wide.scene.bodies[0].tags[0].size_m *= 1.4;
  SceneMap map;
  mapped(wide, &map);
  EXPECT_THAT(scene_doubts(map), testing::Contains(testing::AllOf(
                                     testing::HasSubstr("observations of tag 0 contradict the rest"),
                                     testing::HasSubstr("of the size given"))));
}

TEST(GivenFacts, TheOnlyKnownTagIsNamedWhenItHangsLoose) {
  WideScene wide = test::aisles(24, 8);
  Random random(3);
  for (SceneFrame& frame : wide.recording.frames) {
    for (TagDetection& detection : frame.views[0].detections) {
      if (detection.tag.number != 0) continue;
      const Eigen::Vector2d swing(22 * random.normal(), 5 * random.normal());
      for (Eigen::Vector2d& corner : detection.corners_px) corner += swing;
    }
  }
  SceneMap map;
  mapped(wide, &map);
  EXPECT_THAT(scene_doubts(map), testing::Contains(testing::HasSubstr("of tag 0 contradict the rest")));
}

TEST(GivenFacts, ACovarianceThatCannotBeFoundIsNotZero) {
  Bundle bundle;
  const PoseIndex first = bundle.add({});
  Matrix6 whitening = 1e12 * Matrix6::Identity();
  for (int i = 0; i < 20; ++i) {
    const SE3 step(SO3::exp({0.1, 0.2, 0.3}), Eigen::Vector3d(1000, 10, 1));
    const PoseIndex next = bundle.add(bundle.poses.back().value * step);
    bundle.relatives.push_back({next - 1, next, {step, {}, whitening}});
  }
  const BundleCovariance P = covariance(bundle);
  EXPECT_FALSE(P.undetermined.empty());
  for (PoseIndex i : P.undetermined) EXPECT_GT(P.poses[i].diagonal().maxCoeff(), 1e3) << i;
  EXPECT_GT(P.poses[first].diagonal().minCoeff(), 0);
}

}  // namespace
}  // namespace waymark
