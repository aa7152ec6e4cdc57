#pragma once

#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/server/http_server.hpp"

namespace waymark {

/// The files under a path that the `waymark view` page can show: a recording, the YAML file of a map or a
/// route, or such files in a folder. Empty for an empty path.
[[nodiscard]] Result<std::vector<OfferedFile>> offered_by(const std::string& path, const JobControl& control);

/// Prints notes about truncated recordings, which are shown up to their end, and names the command that
/// repairs them.
void note_damage(const std::vector<OfferedFile>& files, const JobControl& control);

}  // namespace waymark
