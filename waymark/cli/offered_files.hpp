#pragma once

#include <string>
#include <vector>

#include "waymark/cli/console.hpp"
#include "waymark/server/http_server.hpp"

namespace waymark::cli {

/// What the page of `waymark view` can show of a path: a recording, the YAML of a map or a route, what a
/// folder holds of these. Empty path: nothing.
[[nodiscard]] Result<std::vector<OfferedFile>> offered_by(const std::string& path, Console& console);

/// A recording that was cut is shown as far as it goes; it is said here, for the page knows no remedy.
void tell_of_damage(const std::vector<OfferedFile>& files, Console& console);

}  // namespace waymark::cli
