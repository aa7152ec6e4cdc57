#include "waymark/cli/help_text.hpp"

#include <algorithm>
#include <utility>

namespace waymark::cli {
namespace {

constexpr std::size_t kColumns = 100;
constexpr std::size_t kFlagColumns = 34;

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from))
    text.replace(at, from.size(), to);
  return text;
}

}  // namespace

std::string wrapped(std::string_view text, std::size_t width) {
  std::string out;
  std::size_t column = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (word.empty()) continue;
    const bool fits = column + 1 + word.size() <= width;
    if (column > 0) out += fits ? ' ' : '\n';
    column = column > 0 && fits ? column + 1 + word.size() : word.size();
    out += word;
  }
  return out;
}

WrappingFormatter::WrappingFormatter() {
  column_width(kFlagColumns);
  label("SUBCOMMAND", "VERB");
  label("Positionals", "Inputs");
  label("OPTIONS", "FLAGS");
  label("REQUIRED", "(required)");
  label("FLOAT", "NUMBER");
  label("INT", "INTEGER");
  label("UINT", "INTEGER");
}

std::string WrappingFormatter::make_help(const CLI::App* app, std::string name,
                                         CLI::AppFormatMode mode) const {
  std::string help = replaced(CLI::Formatter::make_help(app, std::move(name), mode), "\n\n\n", "\n\n");
  while (help.ends_with("\n\n")) help.pop_back();
  return help;
}

std::string WrappingFormatter::make_option_name(const CLI::Option* option, bool is_positional) const {
  return replaced(CLI::Formatter::make_option_name(option, is_positional), "{false}", "");
}

std::string WrappingFormatter::make_option_desc(const CLI::Option* option) const {
  return wrapped(option->get_description(), kColumns - kFlagColumns);
}

}  // namespace waymark::cli
