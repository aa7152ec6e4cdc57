#pragma once

#include <string>
#include <vector>

namespace waymark {

/// The first warnings of each kind and how many more there are, for people; alike are those that differ in
/// numbers only (ids of tags are numbers). In the order of the first of each kind.
[[nodiscard]] std::vector<std::string> folded_warnings(const std::vector<std::string>& warnings);

}  // namespace waymark
