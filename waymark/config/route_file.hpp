#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/samples/route.hpp"

namespace waymark {

/// A route from route.yaml (docs/formats/map.md). Errors have file, line and key: not a route, an unknown or
/// missing key, fewer than two points, a station that is not on the route, a point that is not six numbers,
/// arc lengths that do not grow, a speed of 0 (backwards is negative), a length that does not reach the last
/// point.
[[nodiscard]] Result<Route> read_route(const std::filesystem::path& path);
[[nodiscard]] Result<Route> parse_route(std::string_view text, const std::string& source);

/// Whether the station may be added to the stations of the route: a name of its own, a place on the route, a
/// pause of 0 s to a day.
[[nodiscard]] Status check_station(const Route& route, const Station& station);

/// Reads back as the same route, to the last bit but for the yaw (within rounding). Every
/// number must be finite.
[[nodiscard]] std::string to_yaml(const Route& route);
/// Fails (InvalidArgument) on a number that is not finite, instead of writing it.
[[nodiscard]] Status write_route(const std::filesystem::path& path, const Route& route);

}  // namespace waymark
