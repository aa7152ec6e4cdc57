#pragma once

#include <string>
#include <string_view>

namespace waymark {

/// Words of a stranger, safe for a terminal: control characters (a terminal obeys them) become \x1b and the
/// like; letters of any language stay.
[[nodiscard]] std::string printable(std::string_view text);

}  // namespace waymark
