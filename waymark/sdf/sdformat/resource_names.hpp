#pragma once
// Inside the room: from names in an SDF file to files.

#include <filesystem>
#include <string>
#include <vector>

namespace waymark {

/// The file or folder that a URI (model://, file://, or a path) means, looked for in the folders one after
/// the other; empty where it is in none.
[[nodiscard]] std::filesystem::path resolve_uri(const std::string& uri,
                                                const std::vector<std::filesystem::path>& folders);

}  // namespace waymark
