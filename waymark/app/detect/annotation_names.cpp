#include "waymark/app/detect/annotation_names.hpp"

#include <cctype>
#include <filesystem>
#include <map>
#include <set>

#include <fmt/format.h>

namespace waymark {
namespace {

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// "a/photo.jpg" as "a__photo.jpg"; "../" and a leading "/" leave no trace.
std::string flat(const std::string& path) {
  std::string name;
  for (const auto& part : std::filesystem::path(path).lexically_normal().relative_path()) {
    if (part == ".." || part == ".") continue;
    name += (name.empty() ? "" : "__") + part.string();
  }
  return name;
}

}  // namespace

std::vector<std::string> annotation_names(const std::vector<std::string>& pictures) {
  std::map<std::string, int> uses;
  for (const std::string& picture : pictures) ++uses[lower(std::filesystem::path(picture).stem().string())];
  std::set<std::string> taken;
  std::vector<std::string> names;
  for (const std::string& picture : pictures) {
    const std::string stem = std::filesystem::path(picture).stem().string();
    const std::string base = uses[lower(stem)] == 1 ? stem : flat(picture);
    std::string name = base + ".png";
    for (int number = 2; !taken.insert(lower(name)).second; ++number)
      name = fmt::format("{}-{}.png", base, number);
    names.push_back(name);
  }
  return names;
}

}  // namespace waymark
