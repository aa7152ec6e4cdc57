#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Transforms corners measured by rolling-shutter cameras to the time of the middle row, using the motion
/// between neighbouring frames at their current poses. Without a neighbour within 0.2 s the motion of a frame
/// is unknown, and the frame is excluded (placed = 0). Returns the largest change of a corner since the last
/// call [px]; 0 if no camera has a rolling shutter.
double bring_corners_to_middle(const SceneRecording& recording, SceneMap& map);

}  // namespace waymark
