#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Transforms corners measured by rolling-shutter cameras to the time of the middle row, using the motion
/// between neighbouring frames at their current poses. If a frame has no neighbour within 0.2 s, its motion
/// is unknown, and the frame is excluded (placed = 0). Returns the largest change in a corner since the last
/// call [px]; this is 0 if no camera has a rolling shutter.
double bring_corners_to_middle(const SceneRecording& recording, SceneMap& map);

}  // namespace waymark
