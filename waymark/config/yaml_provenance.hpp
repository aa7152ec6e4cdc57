#pragma once

#include <string>
#include <utility>
#include <vector>

#include "waymark/config/yaml_cursor.hpp"

namespace waymark::internal {

/// Where a file comes from, in words, in the order of the file: its key `provenance`, which may be missing.
using Provenance = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] Result<Provenance> read_provenance(const YamlCursor& root);
[[nodiscard]] std::string provenance_yaml(const Provenance& provenance);

}  // namespace waymark::internal
