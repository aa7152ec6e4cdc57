#pragma once

#include <string>

namespace waymark {

/// A text as one word of a command to be copied. It is unchanged if it has no special meaning to a shell,
/// else in single quotes.
[[nodiscard]] std::string shell_word(const std::string& text);

}  // namespace waymark
