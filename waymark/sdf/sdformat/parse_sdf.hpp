#pragma once

#include <filesystem>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/sdf/read_sdf.hpp"

namespace waymark {

/// As read_sdf(), with the folders in which names are looked for.
[[nodiscard]] Result<SdfScene> parse_sdf(const std::filesystem::path& file,
                                         const std::vector<std::filesystem::path>& folders);

}  // namespace waymark
