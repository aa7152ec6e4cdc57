#pragma once

#include <string>

namespace waymark {

/// Quotes a text as one word of a shell command that users can copy. The text is unchanged if it has no
/// special meaning to a shell; otherwise it is put in single quotes.
[[nodiscard]] std::string shell_word(const std::string& text);

}  // namespace waymark
