#pragma once

#include <string>
#include <vector>

#include "waymark/app/localize/localize_log.hpp"

namespace waymark {

/// What `waymark localize` prints: estimates, observations, where the robot was last.
[[nodiscard]] std::string to_text(const LocalizeReport& report);
/// What the report gives reason to doubt, and what to do about it.
[[nodiscard]] std::vector<std::string> doubts_about(const LocalizeReport& report);

}  // namespace waymark
