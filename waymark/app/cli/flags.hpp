#pragma once

#include <string>
#include <utility>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "waymark/app/cli/settings.hpp"

/// Flags in one call: add_option(app, "--speed-m-s FLOAT", speed, "Cruising speed", kShown, between(0.01,
/// 5)).
namespace waymark::cli {

/// Its value as it is before parsing stands in the help.
inline constexpr auto kShown = [](CLI::Option& option) { option.capture_default_str(); };
inline constexpr auto kRequired = [](CLI::Option& option) { option.required(); };
/// Only --help-all shows it.
inline constexpr auto kMore = [](CLI::Option& option) { option.group(kMoreGroup); };
/// Several values in one word, with commas between them.
inline constexpr auto kByCommas = [](CLI::Option& option) { option.delimiter(','); };

/// A group of its own in --help-all.
[[nodiscard]] inline auto in_group(std::string name) {
  return [name = std::move(name)](CLI::Option& option) { option.group(name); };
}
template <class Number>
[[nodiscard]] auto between(Number least, Number most) {
  return [least, most](CLI::Option& option) { option.check(CLI::Range(least, most)); };
}
[[nodiscard]] inline auto one_of(std::vector<std::string> words) {
  return [words = std::move(words)](CLI::Option& option) { option.check(CLI::IsMember(words)); };
}

/// `names`: as on the command line, then what its value is called: "-o,--output FILE". A name without a dash
/// is that of an input.
template <class Value, class... Trait>
CLI::Option* add_option(CLI::App& app, const std::string& names, Value& value, const std::string& sentence,
                        const Trait&... traits) {
  const std::size_t space = names.find(' ');
  CLI::Option* option = app.add_option(names.substr(0, space), value, sentence);
  option->type_name(space == std::string::npos ? "" : names.substr(space + 1));
  (traits(*option), ...);
  return option;
}

/// The same of a flag without a value.
template <class... Trait>
CLI::Option* add_flag(CLI::App& app, const std::string& name, bool& value, const std::string& sentence,
                      const Trait&... traits) {
  CLI::Option* option = app.add_flag(name, value, sentence);
  (traits(*option), ...);
  return option;
}

}  // namespace waymark::cli
