#pragma once

#include <concepts>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

/// "1 image", "0 images", "12 images": a count and its noun, whose plural ends in s.
template <std::integral Number>
[[nodiscard]] std::string counted(Number number, const char* thing) {
  return std::to_string(number) + " " + thing + (number == 1 ? "" : "s");
}

/// Makes untrusted text safe for a terminal: control characters, which a terminal would execute, become \x1b
/// and the like. Letters of all languages are kept.
[[nodiscard]] std::string printable(std::string_view text);

/// The candidate nearest to a misspelt word (Damerau edits, case ignored), or empty if no candidate is
/// near enough. O(word · candidates).
[[nodiscard]] std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates);

/// "Did you mean 'tag36h11'?" or, if no candidate is near, "Known: a, b, c."; empty without candidates.
[[nodiscard]] std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace waymark
