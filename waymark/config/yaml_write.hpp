#pragma once

#include <span>
#include <string>
#include <string_view>

namespace waymark {

/// The shortest decimal that reads back as the same double, and as a number (not a whole one, not a word) in
/// every YAML reader: "1.0", "1.0e-05". The value must be finite.
[[nodiscard]] std::string yaml_number(double value);

/// The word as it stands where YAML takes it for a word, else in double quotes with escapes.
[[nodiscard]] std::string yaml_text(std::string_view text);

/// "[1.0, 2.5]".
[[nodiscard]] std::string yaml_list(std::span<const double> values);

}  // namespace waymark
