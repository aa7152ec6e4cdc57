#include "waymark/app/cli/file_names.hpp"

#include <filesystem>
#include <string>
#include <system_error>

#include <fmt/format.h>

#include "waymark/app/common/output_files.hpp"

namespace waymark::cli {

CLI::Validator recording_name() {
  const auto complete = [](std::string& path) {
    const std::filesystem::path name(path);
    if (name.filename().empty()) return fmt::format("'{}' is not the name of a file", path);
    const std::string suffix = name.extension().string();
    if (suffix.empty() && !is_device(path)) path += ".mcap";
    if (suffix.empty() || suffix == ".mcap") return std::string();
    return fmt::format("{}: recordings are written as MCAP: end the name in .mcap, not in {}", path, suffix);
  };
  return {complete, "", "recording"};
}

CLI::Validator yaml_name() {
  const auto check = [](std::string& path) {
    const std::string suffix = std::filesystem::path(path).extension().string();
    std::error_code ignored;
    const bool folder = std::filesystem::is_directory(path, ignored);
    if (suffix == ".yaml" || suffix == ".yml" || (is_device(path) && !folder)) return std::string();
    return fmt::format("{}: what is written is YAML: end the name in .yaml", path);
  };
  return {check, "", "YAML"};
}

}  // namespace waymark::cli
