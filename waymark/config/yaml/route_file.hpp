#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// Reads a route from route.yaml (docs/formats/map.md). Fails with file, line and key on a file of another
/// kind, an unknown or missing key, fewer than two points, or a station that is not on the route. A point
/// must have six numbers and a speed other than 0 (negative in reverse). Arc lengths must increase, and
/// points must not be farther apart than their arc lengths. A length that does not reach the last point, and
/// a gap between two points or before the beginning of a closed route, are errors too. The number of points,
/// the closing gap and the checksum must match the values in the file, which older files do not contain.
[[nodiscard]] Result<Route> read_route(const std::filesystem::path& path);
[[nodiscard]] Result<Route> parse_route(std::string_view text, const std::string& source);

/// Adds some map tags to the route, by which check_map() recognises the map.
[[nodiscard]] Route with_map(Route route, const TagMap& map);
/// Fails if the tags stored in the route do not have the same poses in the map, because the route then
/// belongs to another map. A route without stored tags is not checked.
[[nodiscard]] Status check_map(const Route& route, const TagMap& map, const std::string& source);

/// Checks that the station may be added to the route: it needs a unique name, a position on the route, and a
/// dwell time from 0 s to one day.
[[nodiscard]] Status check_station(const Route& route, const Station& station);

/// The text reads back as exactly the same route, except for the yaw (equal within rounding). Every number
/// must be finite.
[[nodiscard]] std::string to_yaml(const Route& route);
/// Fails (InvalidArgument) without writing if a number is not finite.
[[nodiscard]] Status write_route(const std::filesystem::path& path, const Route& route);

}  // namespace waymark
