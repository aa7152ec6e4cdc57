#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// A route from route.yaml (docs/formats/map.md). Errors have file, line and key: not a route, an unknown or
/// missing key, fewer than two points, a station that is not on the route, a point that is not six numbers,
/// arc lengths that do not grow, a speed of 0 (backwards is negative), a length that does not reach the last
/// point; a hole between two points or before the beginning of a closed route, points farther apart than
/// their arc lengths; a number of points, a closing gap or a checksum other than the file states (files
/// before these keys do not state them).
[[nodiscard]] Result<Route> read_route(const std::filesystem::path& path);
[[nodiscard]] Result<Route> parse_route(std::string_view text, const std::string& source);

/// Notes some tags of the map in the route, by which check_map() recognises it.
[[nodiscard]] Route with_map(Route route, const TagMap& map);
/// Fails when the tags that the route notes are not where the map has them: the route belongs to another map.
/// A route without such notes is not checked.
[[nodiscard]] Status check_map(const Route& route, const TagMap& map, const std::string& source);

/// Whether the station may be added to the stations of the route: a name of its own, a place on the route, a
/// pause of 0 s to a day.
[[nodiscard]] Status check_station(const Route& route, const Station& station);

/// Reads back as the same route, to the last bit but for the yaw (within rounding). Every
/// number must be finite.
[[nodiscard]] std::string to_yaml(const Route& route);
/// Fails (InvalidArgument) on a number that is not finite, instead of writing it.
[[nodiscard]] Status write_route(const std::filesystem::path& path, const Route& route);

}  // namespace waymark
