#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/simulation/robot/faults.hpp"

namespace waymark {

/// Reads a fault script from YAML (docs/formats/faults.md explains all keys). Each entry of the list `faults`
/// specifies the fault, its start (at_s, default 0) and its duration (for_s, default unlimited). Tag ids
/// refer to the family of the world's anchor. Fails with file, line and key on an unknown fault or key, a
/// missing key, or a tag that is not in the world.
[[nodiscard]] Result<std::vector<Fault>> read_faults(const std::filesystem::path& path, const World& world);
[[nodiscard]] Result<std::vector<Fault>> parse_faults(std::string_view text, const std::string& source,
                                                      const World& world);

}  // namespace waymark
