#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/base/error.hpp"

/// `waymark migrate`: maps, routes and calibrations of older versions in the form that this version writes.
namespace waymark {

struct MigrateJob {
  std::filesystem::path input{};   ///< a file, or a folder; folders in it are not looked into
  std::filesystem::path output{};  ///< folder to write; is not there yet, or empty
};

struct MigratedFile {
  std::string name{};      ///< the same in both folders
  std::string kind{};      ///< map, route, calibration, or other: copied
  bool rewritten = false;  ///< false: copied byte for byte
};

/// Writes every file of the input into the output, sorted by name. What stands in a file is kept, comments
/// are not; numbers keep their value within rounding (to_yaml() of each kind). Nothing is written where one
/// of the files is unusable: a format of a later version, whatever the readers refuse.
[[nodiscard]] Result<std::vector<MigratedFile>> migrate_files(const MigrateJob& job);
[[nodiscard]] std::string to_text(const MigratedFile& file);
[[nodiscard]] nlohmann::ordered_json to_json(const MigratedFile& file);

}  // namespace waymark
