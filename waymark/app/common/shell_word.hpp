#pragma once

#include <string>

namespace waymark {

/// A text as one word of a command that is shown to be copied: as it is where no shell reads anything into
/// it, else in single quotes.
[[nodiscard]] std::string shell_word(const std::string& text);

}  // namespace waymark
