#pragma once

#include <algorithm>
#include <chrono>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/tag_scenes.hpp"
#include "waymark/mapping/scene/scene_map.hpp"

/// Errors of maps of wide scenes.
namespace waymark::test {

struct Outcome {
  double mean_m = 0, worst_m = 0;  ///< of the tags in the map, in the frame of the known one
  std::size_t tags = 0;
  double seconds = 0;
};

inline Outcome outcome_of(const WideScene& wide, const SceneMap& map) {
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

inline Outcome mapped(const WideScene& wide, SceneMap* keep = nullptr, const SceneMapOptions& options = {}) {
  const auto start = std::chrono::steady_clock::now();
  auto map = map_scene(wide.scene, wide.recording, options);
  EXPECT_TRUE(map) << to_string(map.error());
  if (!map) return {};
  Outcome outcome = outcome_of(wide, *map);
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (keep != nullptr) *keep = std::move(*map);
  return outcome;
}

}  // namespace waymark::test
