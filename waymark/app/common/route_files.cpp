#include "waymark/app/common/route_files.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "route-";

/// The files that belong to one route of a map.
constexpr std::array<std::pair<const char*, const char*>, 11> kOfRoute = {{{"route", ".yaml"},
                                                                           {"route", ".svg"},
                                                                           {"trajectory", ".txt"},
                                                                           {"trajectory_covariance", ".csv"},
                                                                           {"odometry", ".yaml"},
                                                                           {"truth_trajectory", ".txt"},
                                                                           {"summary", ".json"},
                                                                           {"map", ".svg"},
                                                                           {"before_after", ".svg"},
                                                                           {"error", ".svg"},
                                                                           {"tags_in_view", ".svg"}}};

}  // namespace

std::string file_name_for_route(const std::string& stem, const std::string& route,
                                const std::string& suffix) {
  return route.empty() ? stem + suffix : stem + "-" + route + suffix;
}

std::string route_file_name(const std::string& route) { return file_name_for_route("route", route, ".yaml"); }

std::vector<std::string> route_names(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const fs::path& path = entry->path();
    const std::string stem = path.stem().string();
    const bool numbered = fs::path(stem).has_extension();
    if (path.extension() == ".yaml" && stem.starts_with(kPrefix) && !numbered)
      names.push_back(stem.substr(kPrefix.size()));
  }
  std::ranges::sort(names);
  return names;
}

std::vector<std::string> files_of_route(const std::string& route) {
  std::vector<std::string> names;
  names.reserve(std::size(kOfRoute));
  for (const auto& [stem, suffix] : kOfRoute) names.push_back(file_name_for_route(stem, route, suffix));
  return names;
}

std::vector<std::string> files_of_map(const std::vector<std::string>& routes) {
  std::vector<std::string> names = {"map.yaml", "poses.yaml", "camera_poses.yaml"};
  for (const std::string& route : routes) {
    const std::vector<std::string> of_route = files_of_route(route);
    names.insert(names.end(), of_route.begin(), of_route.end());
  }
  return names;
}

Status check_route_name(const std::string& route, const char* field) {
  const auto allowed = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
  };
  if (!route.empty() && std::ranges::all_of(route, allowed)) return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("invalid route name '{}'", route), {.key = field},
              "Use letters, digits, - and _.");
}

Status check_map_folder(const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder / "map.yaml", ignored)) return {};
  const Place place{.source = folder.string()};
  if (fs::exists(folder / "map" / "map.yaml", ignored))
    return fail(ErrorCode::NotFound, "the folder contains no map.yaml", place,
                fmt::format("Did you mean {}?", (folder / "map").string()));
  if (auto wrong = wrong_kind(folder, FileUse::MapFolder)) return tl::unexpected(*std::move(wrong));
  if (fs::is_regular_file(folder, ignored))
    return fail(ErrorCode::InvalidArgument, "this is a file, not a map folder", place,
                "Give a folder written by `waymark map`.");
  if (!fs::is_directory(folder, ignored))
    return fail(ErrorCode::NotFound, "no such folder", place,
                "Record a lap (`waymark teach`) and map it (`waymark map`) first.");
  return fail(ErrorCode::NotFound, "the folder contains no map.yaml", place,
              "Map a recorded lap into it first: waymark map lap.mcap -o " + folder.string() + ".");
}

Status check_route_exists(const fs::path& folder, const std::string& route) {
  std::error_code ignored;
  if (fs::exists(folder / route_file_name(route), ignored)) return {};
  const std::vector<std::string> names = route_names(folder);
  const Place place{.source = folder.string(), .key = "`route`"};
  if (route.empty())
    return fail(ErrorCode::NotFound, "the folder contains no route.yaml", {.source = folder.string()},
                names.empty()
                    ? "Map a recorded lap into it: waymark map lap.mcap -o " + shell_word(folder.string())
                    : fmt::format("It contains {}: set `route`.", fmt::join(names, ", ")));
  return fail(ErrorCode::NotFound, fmt::format("this map has no route '{}'", route), place,
              names.empty()
                  ? fmt::format("It has only the taught route; `waymark map LAP extend={0} "
                                "route_name={1}` adds one, `waymark optimize {0} name={1}` makes one.",
                                shell_word(folder.string()), shell_word(route))
                  : suggestion(route, names));
}

}  // namespace waymark
