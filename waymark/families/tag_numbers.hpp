#pragma once

#include <string_view>
#include <vector>

#include "waymark/families/family.hpp"

namespace waymark {

/// A list of numbers of a family as people write it: "0-3,7,9" is 0 1 2 3 7 9, in the order written. Errors:
/// InvalidArgument for what is no such list, a range that runs backwards, or a number the family does not
/// have.
[[nodiscard]] Result<std::vector<int>> parse_tag_numbers(FamilyId family, std::string_view text);

}  // namespace waymark
