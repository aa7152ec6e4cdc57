#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

namespace waymark {

/// Where the data that comes with Waymark lies: what the environment variable WAYMARK_SHARE names; else
/// ../share/waymark beside the running program; else share/waymark of the prefix where the library that this
/// is part of is installed (a Python module); else the source tree this was built from; else where it was to
/// be installed. Fails when none of them is there.
[[nodiscard]] Result<std::filesystem::path> share_folder();

/// The file that a word of the command line means: a path (with a '/' or ending in .yaml) as it is, a plain
/// name the file `name`.yaml in a folder ("worlds", "robots") of the share folder. Fails on a name that is
/// not there, with the nearest one; the error is of the field that holds the word: unless given, `world`,
/// `robot_file` or `profile`, by the folder. O(files in the folder).
[[nodiscard]] Result<std::filesystem::path> find_shared(std::string_view folder, const std::string& name,
                                                        std::string_view field = {});

/// What a file means by the name of another one: a relative path ending in .yaml is looked for beside it
/// first; anything else is as it is.
[[nodiscard]] std::string named_beside(const std::filesystem::path& file, const std::string& name);

/// What a world may be called.
inline constexpr std::string_view kWorldNames =
    "circuit24, limo-walls, academy-house, mbot-square, or the path of a .yaml file";

/// What a robot's file may be called.
inline constexpr std::string_view kRobotNames =
    "a name that `waymark robots` lists, or the path of a .yaml file";

}  // namespace waymark
