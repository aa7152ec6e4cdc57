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

/// Makes untrusted text safe for a terminal: control characters, which a terminal would interpret, become
/// escapes such as \x1b. Letters of all languages are kept.
[[nodiscard]] std::string printable(std::string_view text);

/// The candidate closest to a misspelt word by Damerau edit distance, ignoring case; empty if no candidate is
/// close enough. O(word · candidates).
[[nodiscard]] std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates);

/// "Did you mean 'tag36h11'?" or, if no candidate is near, "Known: a, b, c."; empty if there are no
/// candidates.
[[nodiscard]] std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace waymark
