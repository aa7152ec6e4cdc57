#include "waymark/config/share.hpp"

#include <algorithm>
#include <cstdlib>
#include <system_error>
#include <vector>

#include <dlfcn.h>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxLevels = 5;  // from a module up to its install prefix

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

/// If this code runs in a library (the Python module, or that of an application), share/waymark in the
/// library's install prefix, the PREFIX in PREFIX/lib/python3/dist-packages/waymark/_waymark.so. Empty if
/// there is none.
fs::path beside_module() {
  Dl_info module{};
  if (::dladdr(reinterpret_cast<const void*>(&share_folder), &module) == 0 || module.dli_fname == nullptr)
    return {};
  std::error_code ignored;
  fs::path prefix = fs::absolute(module.dli_fname, ignored).parent_path();
  for (int level = 0; level < kMaxLevels && prefix.has_relative_path(); ++level) {
    prefix = prefix.parent_path();
    if (is_folder(prefix / "share/waymark")) return prefix / "share/waymark";
  }
  return {};
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (it->path().extension() == ".yaml") names.push_back(it->path().stem().string());
  }
  std::ranges::sort(names);
  return names;
}

/// The default field for files in the folder.
std::string_view usual_field(std::string_view folder) {
  if (folder == "worlds") return "world";
  return folder == "robots" ? "robot_file" : "profile";
}

/// When searching for worlds, "place/world.yaml" for the folder "place"; empty if it does not exist.
std::string file_inside(std::string_view folder, const std::string& name) {
  const fs::path file = fs::path(name) / (std::string(folder.substr(0, folder.size() - 1)) + ".yaml");
  std::error_code ignored;
  return fs::is_regular_file(file, ignored) ? file.string() : std::string();
}

}  // namespace

Result<fs::path> share_folder() {
  if (const char* named = std::getenv("WAYMARK_SHARE"); named != nullptr && *named != '\0') {
    if (is_folder(named)) return fs::path(named);
    return fail(ErrorCode::NotFound, "the folder of WAYMARK_SHARE does not exist", {.source = named},
                "Unset it, or set it to the folder with worlds/ and robots/.");
  }
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  const fs::path beside = program.parent_path().parent_path() / "share/waymark";
  for (const fs::path& folder :
       {beside, beside_module(), fs::path(WAYMARK_SOURCE_SHARE), fs::path(WAYMARK_INSTALLED_SHARE)}) {
    if (is_folder(folder)) return folder;
  }
  return fail(ErrorCode::NotFound, "cannot find the data of Waymark", {.source = WAYMARK_INSTALLED_SHARE},
              "Set the environment variable WAYMARK_SHARE to the folder with worlds/ and robots/.");
}

Result<fs::path> find_shared(std::string_view folder, const std::string& name, std::string_view field) {
  const Place place{.key = std::string(field.empty() ? usual_field(folder) : field)};
  if (name.find('/') != std::string::npos || name.ends_with(".yaml")) {
    const std::string file = file_inside(folder, name);
    if (file.empty() && !is_folder(name)) return fs::path(name);
    return fail(ErrorCode::InvalidArgument, fmt::format("'{}' is a folder", name), place,
                file.empty() ? "Give the path of a .yaml file." : fmt::format("Did you mean {}?", file));
  }
  const Result<fs::path> share = share_folder();
  if (!share) return share;
  const std::vector<std::string> names = names_in(*share / folder);
  if (std::ranges::find(names, name) != names.end()) return *share / folder / (name + ".yaml");
  std::error_code ignored;
  if (fs::is_regular_file(name, ignored)) return fs::path(name);  // the file's reader reports its kind
  const std::string file = file_inside(folder, name);
  std::string message = fmt::format("there is no '{}' in {}", name, (*share / folder).string());
  if (is_folder(name)) message += ", and the folder of this name is not a .yaml file";
  return fail(ErrorCode::NotFound, std::move(message), place,
              file.empty() ? suggestion(name, names) + " Or give the path of a .yaml file."
                           : fmt::format("Did you mean {}?", file));
}

std::string named_beside(const fs::path& file, const std::string& name) {
  const fs::path there = file.parent_path() / name;
  std::error_code ignored;
  return name.ends_with(".yaml") && fs::is_regular_file(there, ignored) ? there.string() : name;
}

}  // namespace waymark
