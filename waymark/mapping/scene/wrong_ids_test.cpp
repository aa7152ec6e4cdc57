// Scenes in which some ids were misread: their maps are as good as without them, or what they carry is left
// out and named. The long run (50 seeds) with WAYMARK_FULL=1.
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/scene_outcome.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/scene/scene_checks.hpp"

namespace waymark {
namespace {

using test::mapped;
using test::Outcome;
using test::WideScene;

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

}  // namespace
}  // namespace waymark
