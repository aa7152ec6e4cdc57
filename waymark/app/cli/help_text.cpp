#include "waymark/app/cli/help_text.hpp"

#include <algorithm>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/cli/flags.hpp"

namespace waymark::cli {
namespace {

constexpr std::size_t kFlagColumns = 34;

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from))
    text.replace(at, from.size(), to);
  return text;
}

/// Like help_line(), but the name includes the indentation.
std::string key_line(const std::string& name, const std::string& sentence) {
  constexpr std::size_t kIndentOfParser = 2;
  return help_line(name.substr(kIndentOfParser), sentence);
}

/// Number of flags that --help omits.
std::size_t count_more(const CLI::App& app) {
  return app
      .get_options([](const CLI::Option* option) {
        return option->nonpositional() && !option->get_group().empty() && option->get_group() != kFirstGroup;
      })
      .size();
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

std::string help_line(const std::string& name, const std::string& sentence) {
  std::ostringstream line;
  CLI::detail::format_help(line, name, wrapped(sentence, kHelpColumns - kFlagColumns), kFlagColumns);
  return line.str();
}

WrappingFormatter::WrappingFormatter(HasFlag has_flag) : has_flag_(std::move(has_flag)) {
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
  const auto usual = CLI::AppFormatMode::Normal;
  const std::string flags =
      mode == CLI::AppFormatMode::All ? make_groups(app, usual) : make_first_group(*app);
  const bool with_keys = mode == CLI::AppFormatMode::All && !report_.empty();
  const std::string keys = with_keys ? "\nKeys of --json:\n" + make_keys(report_, 2) : "";
  std::string help =
      replaced(make_description(app) + make_usage(app, std::move(name)) + make_positionals(app) + flags +
                   make_subcommands(app, usual) + keys + "\n" + make_footer(app),
               "\n\n\n", "\n\n");
  while (help.ends_with("\n\n")) help.pop_back();
  return help;
}

std::shared_ptr<WrappingFormatter> WrappingFormatter::with_report(ReportFields report) const {
  auto formatter = std::make_shared<WrappingFormatter>(*this);
  formatter->report_ = std::move(report);
  return formatter;
}

std::string WrappingFormatter::make_keys(const ReportFields& report, std::size_t indent) const {
  std::string text;
  for (const ReportField& field : report) {
    const std::string name = fmt::format("{:{}}{} {}{}", "", indent, field.name, field.value.type(),
                                         field.value.may_be_null() ? " or null" : "");
    const std::string sentence(field.sentence);
    text += key_line(name, has_flag_ ? with_flags(sentence, has_flag_) : sentence);
    text += make_keys(field.value.keys(), indent + 2);
  }
  return text;
}

std::string WrappingFormatter::make_first_group(const CLI::App& app) const {
  auto first = app.get_options([](const CLI::Option* option) {
    return option->nonpositional() && option->get_group() == kFirstGroup;
  });
  std::ranges::stable_partition(first, [](const CLI::Option* option) {
    const std::string name = option->get_name();
    return name != "--config" && name != "--set" && !name.ends_with("--help") && name != "--help-all";
  });
  std::string text = make_group(kFirstGroup, false, first);
  const std::size_t more = count_more(app);
  const bool settings = app.get_option_no_throw("--set") != nullptr;
  if (more > 0 && settings)
    text += fmt::format("\n{} more: --help-all, which also lists the keys of --set and --config\n", more);
  else if (more > 0)
    text += fmt::format("\n{} more: --help-all\n", more);
  else if (settings)
    text += "\n--help-all lists the keys of --set and --config\n";
  return text;
}

std::string WrappingFormatter::make_option_name(const CLI::Option* option, bool is_positional) const {
  // The value of a flag that is also an input is named like the input.
  const bool of_input = !is_positional && option->get_positional();
  const std::string value = of_input ? " " + option->get_name(true) : "";
  return replaced(CLI::Formatter::make_option_name(option, is_positional), "{false}", "") + value;
}

std::string WrappingFormatter::make_option_desc(const CLI::Option* option) const {
  const std::string& sentence = option->get_description();
  return wrapped(has_flag_ ? with_flags(sentence, has_flag_) : sentence, kHelpColumns - kFlagColumns);
}

}  // namespace waymark::cli
