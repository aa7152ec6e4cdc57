#pragma once

#include "waymark/recording/ros2/messages.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// A map and its route as markers in the frame `map`. Earlier markers are deleted. Each tag is drawn cell by
/// cell as printed, with its id above it. If the map contains the tag's covariance, an ellipsoid of three
/// standard deviations of its centre is added. Tags in maps of more than 300 tags are drawn as plain white
/// sheets instead. The route is a line on the floor; a route without points is omitted.
[[nodiscard]] ros2::MarkerArray map_markers(const TagMap& map, const Route& route);

}  // namespace waymark
