#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/base/error.hpp"
#include "waymark/base/job_field.hpp"

/// `waymark migrate`: maps, routes and calibrations of older versions in the form that this version writes.
namespace waymark {

struct MigrateJob {
  std::filesystem::path input{};   ///< a file, or a folder with all folders in it
  std::filesystem::path output{};  ///< folder to write; is not there yet, or empty

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.input,
          JobField("input INPUT", "Folder that `waymark map` wrote, or one file").input().required());
    visit(self.output, JobField("output FOLDER", "Folder to write, not there yet or empty").required());
  }
};

struct MigratedFile {
  enum class Done { Copied, CopiedWithoutFormat, Rewritten, LeftOut };
  std::string name{};  ///< the same in both folders, below which it stands
  std::string kind{};  ///< map, route, calibration, or other
  Done done =
      Done::Copied;  ///< CopiedWithoutFormat: map.yaml, route.yaml or calibration.yaml by its name only
};

/// Writes every file of the input into the output, sorted by name. A map, route or calibration that differs
/// from today's form (to_yaml() of each kind) in more than the rounding of its numbers is rewritten: what
/// stands in it is kept, comments are not. Everything else is copied byte for byte, but for links to folders,
/// broken links, sockets and pipes, which are left out. A second migration thus changes nothing. Nothing is
/// written where one of the files is unusable: a format of a later version, whatever the readers refuse.
[[nodiscard]] Result<std::vector<MigratedFile>> migrate_files(const MigrateJob& job);
[[nodiscard]] std::string to_text(const MigratedFile& file);
[[nodiscard]] nlohmann::ordered_json to_json(const MigratedFile& file);

}  // namespace waymark
