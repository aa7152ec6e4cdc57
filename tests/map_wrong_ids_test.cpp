// Maps of scenes in which some ids were misread: as good as without them, or what they carry is left out and
// named. The long run (50 seeds) with WAYMARK_FULL=1.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include <gtest/gtest.h>

#include "tests/support/tag_scenes.hpp"
#include "waymark/mapping/scene_map.hpp"

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
  const int seeds = full ? 50 : 2;
  constexpr int kTags = 520;
  for (int seed = 1; seed <= seeds; ++seed) {
    const WideScene clean = test::aisles(kTags, static_cast<std::uint64_t>(seed));
    const Outcome reference = mapped(clean);
    EXPECT_EQ(reference.tags, kTags);
    std::printf("seed %d: %zu detections in %zu frames, clean %.3f m (worst %.3f), %zu tags, %.2f s\n", seed,
                clean.detections, clean.recording.frames.size(), reference.mean_m, reference.worst_m,
                reference.tags, reference.seconds);
    for (double share : {0.0005, 0.005, 0.02}) {
      WideScene spoilt = clean;
      const std::size_t wrong =
          test::misread(spoilt.recording, kTags, share, 1000 + static_cast<std::uint64_t>(seed));
      const Outcome outcome = mapped(spoilt);
      std::printf("  %zu wrong ids: %.3f m (worst %.3f), %zu tags, %.2f s\n", wrong, outcome.mean_m,
                  outcome.worst_m, outcome.tags, outcome.seconds);
      EXPECT_LT(outcome.mean_m, 1.5 * reference.mean_m) << "seed " << seed << ", share " << share;
      EXPECT_GE(static_cast<double>(outcome.tags), (share > 0.01 ? 0.90 : 0.98) * kTags) << seed;
    }
  }
}

}  // namespace
}  // namespace waymark
