#pragma once

#include <string>
#include <vector>

#include "waymark/cli/console.hpp"

namespace waymark::cli {

/// The first warnings of each kind and how many more there are; alike are those that differ in numbers only
/// (ids of tags are numbers). In the order of the first of each kind.
[[nodiscard]] std::vector<std::string> folded(const std::vector<std::string>& warnings);

/// "warning: ..." of each, folded.
void say_warnings(const std::vector<std::string>& warnings, Console& console);

}  // namespace waymark::cli
