#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/sdf/read_sdf.hpp"

namespace waymark {

/// Like read_sdf(), but with the complete list of folders to search for names.
[[nodiscard]] Result<SdfScene> parse_sdf(const std::filesystem::path& file,
                                         const std::vector<std::filesystem::path>& folders);

/// The file or folder that a URI refers to (model://, file://, or a path), searched for in the folders in
/// order; empty if not found.
[[nodiscard]] std::filesystem::path resolve_uri(const std::string& uri,
                                                const std::vector<std::filesystem::path>& folders);

}  // namespace waymark
