#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace waymark {

/// The candidate nearest to a misspelt word (Damerau's edits, case ignored), or empty when none is near
/// enough to help. O(word · candidates).
[[nodiscard]] std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates);

/// "Did you mean 'tag36h11'?" or, when nothing is near, "Known: a, b, c."; empty without candidates.
[[nodiscard]] std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace waymark
