#include "waymark/sdf/sdformat/resource_names.hpp"

#include <algorithm>
#include <string_view>
#include <system_error>

namespace waymark {

std::filesystem::path resolve_uri(const std::string& uri, const std::vector<std::filesystem::path>& folders) {
  namespace fs = std::filesystem;
  std::string_view name = uri;
  for (const std::string_view scheme : {"model://", "file://", "package://"})
    if (name.starts_with(scheme)) name.remove_prefix(scheme.size());
  const fs::path wanted(name);
  std::error_code ignored;
  if (name.empty()) return {};
  if (wanted.is_absolute()) return fs::exists(wanted, ignored) ? wanted : fs::path();
  for (const fs::path& folder : folders)
    if (fs::path found = folder / wanted; fs::exists(found, ignored)) return found;
  return {};
}

}  // namespace waymark
