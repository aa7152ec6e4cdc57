#pragma once

#include <cstddef>
#include <string_view>

namespace waymark {

/// How deep lists and objects stand in each other in a JSON text; counting ends beyond `most`. Asked before a
/// foreign text is parsed: what walks a parsed value calls itself at each level, and a text of brackets alone
/// would use up the stack. A text that is no JSON has a depth, too.
[[nodiscard]] std::size_t json_depth(std::string_view text, std::size_t most);

}  // namespace waymark
