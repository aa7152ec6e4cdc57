#pragma once

#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/server/http_server.hpp"

namespace waymark {

/// What the page of `waymark view` can show of a path: a recording, the YAML of a map or a route, what a
/// folder holds of these. Empty path: nothing.
[[nodiscard]] Result<std::vector<OfferedFile>> offered_by(const std::string& path, const JobControl& control);

/// A recording that was cut is shown as far as it goes; the control gets a note with the remedy.
void tell_of_damage(const std::vector<OfferedFile>& files, const JobControl& control);

}  // namespace waymark
