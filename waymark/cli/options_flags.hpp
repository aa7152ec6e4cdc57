#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>

#include "waymark/base/fields.hpp"

namespace waymark::cli {

/// "--quad-decimate" for "quad_decimate".
[[nodiscard]] inline std::string flag_name(std::string_view field_name) {
  std::string flag = "--" + std::string(field_name);
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

/// The field's sentence and what is allowed or usual: "Look for quads in a smaller image. From 1 to 8.".
template <class Value>
[[nodiscard]] std::string flag_help(const Value& usual, const Field& field) {
  std::string range;
  if constexpr (std::is_same_v<Value, bool>) {
    range = usual ? " On unless said otherwise." : " Off unless said otherwise.";
  } else if constexpr (std::is_arithmetic_v<Value>) {
    if (std::isfinite(field.min) && std::isfinite(field.max))
      range = fmt::format(" From {} to {}.", field.min, field.max);
    if (std::isfinite(field.min) && !std::isfinite(field.max))
      range = fmt::format(" At least {}.", field.min);
    if (!std::isfinite(field.min) && std::isfinite(field.max)) range = fmt::format(" At most {}.", field.max);
  }
  return std::string(field.sentence) + range;
}

/// Flags for every field of an option struct, made from its fields(): name with dashes, sentence, range,
/// default. Flags that were given override what a configuration file said. Must stay where it is while the
/// command line is parsed.
template <HasFields Options>
class OptionFlags {
 public:
  OptionFlags(CLI::App& app, const std::string& group) {
    Options::fields(given_, [&](auto& value, const Field& field) {
      using Value = std::remove_cvref_t<decltype(value)>;
      const std::string flag = flag_name(field.name);
      CLI::Option* option = nullptr;  // stays null for lists and the like: their verb makes a flag by hand
      if constexpr (std::is_same_v<Value, bool>) {
        option = app.add_flag(flag + ",!--no-" + flag.substr(2), value, flag_help(value, field));
      } else if constexpr (std::is_arithmetic_v<Value> || std::is_same_v<Value, std::string>) {
        option = app.add_option(flag, value, flag_help(value, field))->capture_default_str();
      }
      if (option != nullptr) option->group(group);
      flags_.push_back(option);
    });
  }
  OptionFlags(const OptionFlags&) = delete;
  OptionFlags& operator=(const OptionFlags&) = delete;

  /// Whether any of them was given.
  [[nodiscard]] bool given() const {
    return std::ranges::any_of(flags_,
                               [](const CLI::Option* flag) { return flag != nullptr && flag->count() > 0; });
  }
  /// Writes the flags that were given over `options`; fails when one is outside its range.
  [[nodiscard]] Status apply(Options& options) const {
    if (Status status = check_ranges(given_); !status) {
      Error error = status.error();
      error.place.key = flag_name(error.place.key);
      return tl::unexpected(error);
    }
    std::size_t next = 0;
    std::vector<const void*> sources;
    Options::fields(given_, [&](const auto& value, const Field&) { sources.push_back(&value); });
    Options::fields(options, [&](auto& value, const Field&) {
      using Value = std::remove_cvref_t<decltype(value)>;
      if (flags_[next] != nullptr && flags_[next]->count() > 0)
        value = *static_cast<const Value*>(sources[next]);
      ++next;
    });
    return {};
  }

 private:
  Options given_{};
  std::vector<CLI::Option*> flags_;
};

}  // namespace waymark::cli
