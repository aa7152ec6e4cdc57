#pragma once

#include <vector>

#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// The longest way along a taught lap during which no frame held a tag of the map [m]. Frames and poses in
/// order of time; a pose has the stamp of its frame.
[[nodiscard]] double longest_without_tags_m(const Trajectory& lap, const std::vector<TagFrame>& frames,
                                            const TagMap& map);

/// The same of a route whose lap is not known, by which tags any of the cameras could see; occlusion is not
/// considered.
[[nodiscard]] double longest_without_tags_m(const Route& route, const TagMap& map,
                                            const std::vector<MountedCamera>& cameras);

}  // namespace waymark
