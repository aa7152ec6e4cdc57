#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/route.hpp"

/// The routes in a map folder: route.yaml, which was taught first, and route-NAME.yaml.
namespace waymark {

/// Returns "route.yaml" or "route-NAME.yaml".
[[nodiscard]] std::string route_file_name(const std::string& route);
/// Returns the name of a file that belongs to a route, such as "trajectory.txt" or "trajectory-NAME.txt".
[[nodiscard]] std::string file_name_for_route(const std::string& stem, const std::string& route,
                                              const std::string& suffix);
/// The names of the named routes in a folder, in order. Routes of older maps (route-NAME.1.yaml) are
/// excluded.
[[nodiscard]] std::vector<std::string> route_names(const std::filesystem::path& folder);

/// The names of the files that belong to one route of a map.
[[nodiscard]] std::vector<std::string> files_of_route(const std::string& route);
/// The names of the files that mapping writes for a map and these routes ("" is the route taught first).
/// Excludes robot.yaml, which belongs to the robot.
[[nodiscard]] std::vector<std::string> files_of_map(const std::vector<std::string>& routes);

/// Fails unless the name consists of letters, digits, - and _; the error names the field.
[[nodiscard]] Status check_route_name(const std::string& route, const char* field);
/// Fails if the path is not a map folder; the hint names a subfolder with a map, if there is one.
[[nodiscard]] Status check_map_folder(const std::filesystem::path& folder);
/// Fails if the folder has no route with this name (route.yaml if empty); the error lists the existing names.
[[nodiscard]] Status check_route_exists(const std::filesystem::path& folder, const std::string& route);

}  // namespace waymark
