#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/simulation/robot/faults.hpp"

namespace waymark {

/// A script of faults from YAML (docs/formats/faults.md explains all keys): `faults`, a list whose entries
/// say which fault, from when (at_s, 0 unless given) and for how long (for_s, for ever unless given). Numbers
/// of tags are of the family of the world's anchor. Errors have file, line and key: an unknown fault or key,
/// a key that a fault needs, a tag that is not in the world.
[[nodiscard]] Result<std::vector<Fault>> read_faults(const std::filesystem::path& path, const World& world);
[[nodiscard]] Result<std::vector<Fault>> parse_faults(std::string_view text, const std::string& source,
                                                      const World& world);

}  // namespace waymark
