#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/base/error.hpp"
#include "waymark/samples/route.hpp"

/// `waymark routes`: the routes of a map's folder, and where the robot pauses on them.
namespace waymark {

struct RoutesJob {
  std::string folder{};  ///< that `waymark map` wrote
  /// This route alone; nothing: all of them, or where a station changes the taught one.
  std::optional<std::string> route{};
  std::string station{};            ///< put on the route, or moved
  std::optional<double> at_m{};     ///< where: along the route …
  std::string at_tag{};             ///< … or nearest to this tag
  std::optional<double> pause_s{};  ///< nothing: 5 s, or what a station that is moved had
  std::string remove{};             ///< a station
};

/// Name ("" for the taught one) and route.
using NamedRoutes = std::vector<std::pair<std::string, Route>>;

/// The routes that are asked for, after the change that is asked for was written.
[[nodiscard]] Result<NamedRoutes> edit_routes(const RoutesJob& job);
[[nodiscard]] std::string to_text(const std::string& name, const Route& route);
[[nodiscard]] nlohmann::ordered_json to_json(const std::string& name, const Route& route);

}  // namespace waymark
