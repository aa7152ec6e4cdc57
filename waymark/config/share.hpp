#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

namespace waymark {

/// The folder with the data that comes with Waymark. The folder given by the environment variable
/// WAYMARK_SHARE is tried first, then ../share/waymark next to the running program. After these come
/// share/waymark in the prefix where this library is installed (as a Python module), the source tree of the
/// build, and the install location. Fails if none exists.
[[nodiscard]] Result<std::filesystem::path> share_folder();

/// Resolves a file argument of the command line. A path (containing '/' or ending in .yaml) is used
/// unchanged. A plain name is the file `name`.yaml in a folder ("worlds", "robots") of the share folder.
/// Fails on an unknown name and suggests the nearest one. `field` is the field reported in the error; by
/// default `world`, `robot_file` or `profile`, depending on the folder. O(files in the folder).
[[nodiscard]] Result<std::filesystem::path> find_shared(std::string_view folder, const std::string& name,
                                                        std::string_view field = {});

/// Resolves a file name used in another file: a relative path ending in .yaml is first looked up next to that
/// file; anything else is returned unchanged.
[[nodiscard]] std::string named_beside(const std::filesystem::path& file, const std::string& name);

/// Valid world names, for the help text.
inline constexpr std::string_view kWorldNames =
    "circuit24, limo-walls, academy-house, mbot-square, or the path of a .yaml file";

/// Valid robot file names, for the help text.
inline constexpr std::string_view kRobotNames =
    "a name that `waymark robots` lists, or the path of a .yaml file";

}  // namespace waymark
