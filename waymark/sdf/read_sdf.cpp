#include "waymark/sdf/read_sdf.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <system_error>

#include "waymark/modules/load_module.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

void add_listed(const char* variable, std::vector<fs::path>& folders) {
  const char* listed = std::getenv(variable);
  std::string_view rest = listed == nullptr ? "" : listed;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(':'), rest.size());
    if (end > 0) folders.emplace_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
}

std::vector<fs::path> searched(const fs::path& file, std::vector<fs::path> folders) {
  const fs::path beside = file.has_parent_path() ? file.parent_path() : fs::path(".");
  for (const fs::path& folder : {beside, beside / "models", beside / ".." / "models"})
    folders.push_back(folder);
  add_listed("IGN_GAZEBO_RESOURCE_PATH", folders);
  add_listed("SDF_PATH", folders);
  return folders;
}

}  // namespace

Result<SdfScene> read_sdf(const fs::path& file, const std::vector<fs::path>& folders) {
  constexpr std::uintmax_t kMaxBytes = 64U << 20U;
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    return fail(ErrorCode::NotFound, fs::exists(file, error) ? "this is not a file" : "there is no such file",
                {.source = file.string()}, "Give the .sdf or .world file of a world.");
  if (fs::file_size(file, error) > kMaxBytes)
    return fail(ErrorCode::LimitExceeded, "the file is larger than 64 MiB", {.source = file.string()});
  const auto symbol = load_module({.file = "libwaymark-sdf.so",
                                   .symbol = kReadSdfSymbol,
                                   .purpose = "SDF",
                                   .needs = "libsdformat12-12 and libassimp5",
                                   .build = "libsdformat-dev and libassimp-dev"});
  if (!symbol) return tl::unexpected(symbol.error());
  SdfScene scene;
  Error failed;
  reinterpret_cast<ReadSdfFunction>(*symbol)(file, searched(file, folders), scene, failed);
  if (!failed.message.empty()) return tl::unexpected(failed);
  return scene;
}

}  // namespace waymark
