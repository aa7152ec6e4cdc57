#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace waymark::cli {

/// Whether the program has a flag of that name: "--tag-size-m".
using HasFlag = std::function<bool(std::string_view flag)>;

/// Texts of the library name the fields of options between backticks; this writes them as flags:
/// "`tag_size_m`" becomes "--tag-size-m", "`tag_size_m=0.16`" "--tag-size-m 0.16", "`output`" "-o". In a
/// command of the program, "`waymark map LAP anchor=ID json=true`", the fields become flags and the backticks
/// stay; a field that is "true" is a switch. Words that are no flags stay as they are. O(text).
[[nodiscard]] std::string with_flags(std::string_view text, const HasFlag& has_flag);

}  // namespace waymark::cli
