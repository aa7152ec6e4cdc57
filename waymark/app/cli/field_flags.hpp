#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace waymark::cli {

/// Whether the program has the flag "--tag-size-m".
using HasFlag = std::function<bool(std::string_view flag)>;

/// Replaces the fields that texts of the library name between backticks by flags: "`tag_size_m`" becomes
/// "--tag-size-m", "`tag_size_m=0.16`" "--tag-size-m 0.16", "`output`" "-o". In a command of the program,
/// "`waymark map LAP anchor=ID json=true`", the fields become flags and the backticks stay; a field with the
/// value "true" is a switch. Words without a flag are unchanged. O(length of the text).
[[nodiscard]] std::string with_flags(std::string_view text, const HasFlag& has_flag);

}  // namespace waymark::cli
