#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

namespace waymark {

/// Folder of the data that comes with Waymark. The environment variable WAYMARK_SHARE is tried first, then
/// ../share/waymark next to the running program. Next are share/waymark of the prefix where this library is
/// installed (a Python module), the source tree of the build, and the install location. Fails if none exists.
[[nodiscard]] Result<std::filesystem::path> share_folder();

/// Resolves a file argument of the command line. A path (with a '/' or ending in .yaml) is used unchanged. A
/// plain name is the file `name`.yaml in a folder ("worlds", "robots") of the share folder. Fails on an
/// unknown name and suggests the nearest one. `field` is the field reported in the error; by default `world`,
/// `robot_file` or `profile`, depending on the folder. O(files in the folder).
[[nodiscard]] Result<std::filesystem::path> find_shared(std::string_view folder, const std::string& name,
                                                        std::string_view field = {});

/// Resolves a file name used in another file: a relative path ending in .yaml is first looked up next to that
/// file; anything else is returned unchanged.
[[nodiscard]] std::string named_beside(const std::filesystem::path& file, const std::string& name);

/// Valid names of a world, for help.
inline constexpr std::string_view kWorldNames =
    "circuit24, limo-walls, academy-house, mbot-square, or the path of a .yaml file";

/// Valid names of a robot file, for help.
inline constexpr std::string_view kRobotNames =
    "a name that `waymark robots` lists, or the path of a .yaml file";

}  // namespace waymark
