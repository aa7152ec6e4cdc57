#pragma once

#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

namespace waymark {

/// The robot file that a world file names for whoever names none (its key `robot`); empty: it names none.
[[nodiscard]] Result<std::string> robot_of_world(std::string_view text, const std::string& source);

}  // namespace waymark
