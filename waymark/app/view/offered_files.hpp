#pragma once

#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/server/http_server.hpp"

namespace waymark {

/// The files at a path that the page of `waymark view` can show: a recording, the YAML of a map or a route,
/// or such files in a folder. None for an empty path.
[[nodiscard]] Result<std::vector<OfferedFile>> offered_by(const std::string& path, const JobControl& control);

/// Notes truncated recordings, which are shown up to their end, and the command that repairs them.
void note_damage(const std::vector<OfferedFile>& files, const JobControl& control);

}  // namespace waymark
