#pragma once

#include "waymark/recording/ros2/messages.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// A map and its route as shapes in the frame map, for programs that draw markers: all earlier ones are
/// deleted, each tag is drawn cell by cell as it is printed, with its number above it and, where the map
/// knows it, the ellipsoid of three standard deviations of its centre (plain white alone in a map of more
/// than 300 tags), and the route is a line at the floor. A route without points is left out.
[[nodiscard]] ros2::MarkerArray map_markers(const TagMap& map, const Route& route);

}  // namespace waymark
