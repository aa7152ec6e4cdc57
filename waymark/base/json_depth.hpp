#pragma once

#include <cstddef>
#include <string_view>

namespace waymark {

/// Nesting depth of lists and objects in a JSON text; counting stops once the depth exceeds `most`. Check it
/// before parsing untrusted text: code that walks a parsed value recurses at each level, and a text
/// consisting only of brackets would exhaust the stack. The text need not be valid JSON.
[[nodiscard]] std::size_t json_depth(std::string_view text, std::size_t most);

}  // namespace waymark
