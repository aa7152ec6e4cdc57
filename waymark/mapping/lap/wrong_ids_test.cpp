// Laps with wheels in which some ids were misread: their maps are as good as without them, and name what was
// left out. The long run (10 seeds) with WAYMARK_FULL=1.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/warehouse.hpp"
#include "waymark/mapping/lap/map_checks.hpp"

namespace waymark {
namespace {

struct LapErrors {
  double mean_m = 0, worst_m = 0;
  std::size_t tags = 0;
  double seconds = 0;
};

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
  LapErrors of{};
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
    const LapErrors reference = mapped(clean).of;
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
}  // namespace
}  // namespace waymark
