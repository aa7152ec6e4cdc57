#include "waymark/base/json_depth.hpp"

#include <algorithm>

namespace waymark {
namespace {

/// Position after the closing quote of the string that begins before `at`.
std::size_t end_of_string(std::string_view text, std::size_t at) {
  while ((at = text.find_first_of("\"\\", at)) != std::string_view::npos) {
    if (text[at] == '"') return at + 1;
    at += 2;  // skips an escaped quote or backslash
  }
  return text.size();
}

}  // namespace

std::size_t json_depth(std::string_view text, std::size_t most) {
  std::size_t depth = 0;
  std::size_t deepest = 0;
  std::size_t at = 0;
  while (deepest <= most && (at = text.find_first_of("\"[]{}", at)) < text.size()) {
    const char c = text[at++];
    if (c == '"') at = end_of_string(text, at);
    if (c == '[' || c == '{') deepest = std::max(deepest, ++depth);
    if ((c == ']' || c == '}') && depth > 0) --depth;
  }
  return deepest;
}

}  // namespace waymark
