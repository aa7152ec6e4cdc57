#pragma once

#include <string>
#include <string_view>

#include <CLI/App.hpp>
#include <CLI/Formatter.hpp>

namespace waymark::cli {

/// Text with line breaks such that no line is longer than `width` columns (words longer than that stay
/// whole).
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t width);

/// Help in 100 columns: descriptions of flags are wrapped, plain words for the kinds of values.
class WrappingFormatter : public CLI::Formatter {
 public:
  WrappingFormatter();
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override;
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
};

}  // namespace waymark::cli
