#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Fills in what came out: covariance, reprojection, what was left out and what hangs apart.
void report_scene(const SceneRecording& recording, SceneMap& map);

/// Mean and median distance of the corners in use from where they project.
void measure_reprojection(SceneMap& map);

}  // namespace waymark
