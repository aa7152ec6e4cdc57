#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace waymark::cli {

/// Whether the program has a flag such as "--tag-size-m".
using HasFlag = std::function<bool(std::string_view flag)>;

/// Replaces fields that the library's messages name between backticks with flags: "`tag_size_m`" becomes
/// "--tag-size-m", "`tag_size_m=0.16`" becomes "--tag-size-m 0.16", and "`output`" becomes "-o". In a command
/// such as "`waymark map LAP anchor=ID json=true`", the fields become flags and the backticks are kept; a
/// field with the value "true" becomes a switch. Words without a corresponding flag are unchanged. O(length
/// of the text).
[[nodiscard]] std::string with_flags(std::string_view text, const HasFlag& has_flag);

}  // namespace waymark::cli
