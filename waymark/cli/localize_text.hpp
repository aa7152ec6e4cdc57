#pragma once

#include <string>

#include "waymark/jobs/localize_log.hpp"

namespace waymark::cli {

/// What `waymark localize` prints: estimates, observations, where the robot was last.
[[nodiscard]] std::string to_text(const LocalizeReport& report);

}  // namespace waymark::cli
