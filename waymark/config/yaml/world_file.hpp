#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {

/// Reads a world from YAML (docs/formats/world.md explains all keys): name, tag_family, tag_size_m,
/// anchor_id, tags (id, x_m, y_m, z_m, facing_deg), path_closed and path_m. The keys panels, walls,
/// occluders, keep_outs and floor are optional. Fails with file, line and key on an unknown or missing key,
/// an implausible number, or an id that is a duplicate or not in the family. An anchor that is not among the
/// tags, and a path of fewer than three points, are errors too.
[[nodiscard]] Result<World> read_world(const std::filesystem::path& path);
[[nodiscard]] Result<World> parse_world(std::string_view text, const std::string& source);

/// Writes a world with tags of one family, furniture (occluders) and a line as YAML. The text reads back as
/// the same world to within a millimetre and a tenth of a degree. Panels, walls, keep-outs and floor are not
/// written.
[[nodiscard]] std::string to_yaml(const World& world);

/// The default robot file of a world (its key `robot`); empty if it has none.
[[nodiscard]] Result<std::string> robot_of_world(std::string_view text, const std::string& source);

}  // namespace waymark
