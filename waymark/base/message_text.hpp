#pragma once

#include <concepts>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

/// "1 picture", "0 pictures", "12 pictures": how many of a thing, whose plural has an s.
template <std::integral Number>
[[nodiscard]] std::string counted(Number number, const char* thing) {
  return std::to_string(number) + " " + thing + (number == 1 ? "" : "s");
}

/// Words of a stranger, safe for a terminal: control characters (a terminal obeys them) become \x1b and the
/// like; letters of any language stay.
[[nodiscard]] std::string printable(std::string_view text);

/// The candidate nearest to a misspelt word (Damerau's edits, case ignored), or empty when none is near
/// enough to help. O(word · candidates).
[[nodiscard]] std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates);

/// "Did you mean 'tag36h11'?" or, when nothing is near, "Known: a, b, c."; empty without candidates.
[[nodiscard]] std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace waymark
