#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/route.hpp"

/// The routes of a map folder: route.yaml, taught first, and route-NAME.yaml.
namespace waymark {

/// "route.yaml", or "route-NAME.yaml".
[[nodiscard]] std::string route_file_name(const std::string& route);
/// "trajectory.txt", or "trajectory-NAME.txt": the name of a file of one route.
[[nodiscard]] std::string file_name_for_route(const std::string& stem, const std::string& route,
                                              const std::string& suffix);
/// The names of the named routes of a folder, in order; routes of older maps (route-NAME.1.yaml) are not
/// among them.
[[nodiscard]] std::vector<std::string> route_names(const std::filesystem::path& folder);

/// The names of the files of one route of a map.
[[nodiscard]] std::vector<std::string> files_of_route(const std::string& route);
/// The names of the files that mapping writes for a map and these routes ("": the route taught first).
/// Excludes robot.yaml, which belongs to the robot.
[[nodiscard]] std::vector<std::string> files_of_map(const std::vector<std::string>& routes);

/// Letters, digits, - and _; the error names the field.
[[nodiscard]] Status check_route_name(const std::string& route, const char* field);
/// Fails if it is not a map folder; the hint names a subfolder with a map if one exists.
[[nodiscard]] Status check_map_folder(const std::filesystem::path& folder);
/// Fails, with the existing names, if the folder has no route of this name. Empty: route.yaml.
[[nodiscard]] Status check_route_exists(const std::filesystem::path& folder, const std::string& route);

}  // namespace waymark
