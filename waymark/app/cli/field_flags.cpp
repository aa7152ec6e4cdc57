#include "waymark/app/cli/field_flags.hpp"

#include <algorithm>
#include <optional>

#include "waymark/app/cli/flags.hpp"

namespace waymark::cli {
namespace {

bool is_field(std::string_view word) {
  const auto fits = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  return !word.empty() && word.front() >= 'a' && word.front() <= 'z' && std::ranges::all_of(word, fits);
}

/// Returns "--tag-size-m 0.16" for "tag_size_m=0.16"; `nullopt` if there is no such flag.
std::optional<std::string> flag_of(std::string_view word, const HasFlag& has_flag) {
  const std::string_view field = word.substr(0, word.find('='));
  if (!is_field(field) || !has_flag(flag_name(field))) return std::nullopt;
  const std::string flag = field == "output" ? "-o" : flag_name(field);
  if (field.size() == word.size() || word.substr(field.size()) == "=true") return flag;
  return flag + " " + std::string(word.substr(field.size() + 1));
}

/// The command with its fields replaced by flags.
std::string command_of(std::string_view command, const HasFlag& has_flag) {
  std::string text;
  while (!command.empty()) {
    const std::size_t end = std::min(command.find(' '), command.size());
    const std::string_view word = command.substr(0, end);
    const auto flag = word.find('=') == std::string_view::npos ? std::nullopt : flag_of(word, has_flag);
    text += flag ? *flag : std::string(word);
    if (end < command.size()) text += ' ';
    command.remove_prefix(std::min(end + 1, command.size()));
  }
  return text;
}

}  // namespace

std::string with_flags(std::string_view text, const HasFlag& has_flag) {
  constexpr std::string_view kCommand = "waymark ";
  std::string written;
  while (true) {
    const std::size_t begin = text.find('`');
    const std::size_t end = begin == std::string_view::npos ? begin : text.find('`', begin + 1);
    if (end == std::string_view::npos) return written.append(text);
    written += text.substr(0, begin);
    const std::string_view quoted = text.substr(begin + 1, end - begin - 1);
    if (quoted.starts_with(kCommand)) {
      written += "`" + command_of(quoted, has_flag) + "`";
    } else if (const auto flag = flag_of(quoted, has_flag)) {
      written += *flag;
    } else {  // the second backtick may start the next quoted part
      written += "`" + std::string(quoted);
      text.remove_prefix(end);
      continue;
    }
    text.remove_prefix(end + 1);
  }
}

}  // namespace waymark::cli
