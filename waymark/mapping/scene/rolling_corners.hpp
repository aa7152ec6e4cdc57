#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Brings the corners that cameras with a rolling shutter measured to the time of the middle row, by the
/// motion through the neighbouring frames as they stand now. Frames
/// without a neighbour within 0.2 s tell no motion: they do not count (placed = 0). The largest change of a
/// corner since the last call [px]; 0 when no camera has such a shutter.
double bring_corners_to_middle(const SceneRecording& recording, SceneMap& map);

}  // namespace waymark
