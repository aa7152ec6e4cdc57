#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <CLI/App.hpp>
#include <CLI/Formatter.hpp>

#include "waymark/app/cli/field_flags.hpp"
#include "waymark/app/common/report_fields.hpp"

namespace waymark::cli {

/// Wraps the text between words to lines of at most `width` columns; longer words are not split.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t width);

/// Maximum length of a line in a help text.
inline constexpr std::size_t kHelpColumns = 100;

/// One line in a group of flags, with the sentence aligned with the descriptions of the flags.
[[nodiscard]] std::string help_line(const std::string& name, const std::string& sentence);

/// Formats help in 100 columns, with wrapped descriptions and plain names for value types. --help shows the
/// group "Options" and the number of other flags; --help-all shows all groups.
class WrappingFormatter : public CLI::Formatter {
 public:
  /// Fields named in sentences are printed as the program's flags.
  explicit WrappingFormatter(HasFlag has_flag = {});
  /// Makes --help-all also list the keys of `report`.
  [[nodiscard]] std::shared_ptr<WrappingFormatter> with_report(ReportFields report) const;
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override;
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override;
  std::string make_option_desc(const CLI::Option* option) const override;

 private:
  [[nodiscard]] std::string make_first_group(const CLI::App& app) const;
  [[nodiscard]] std::string make_keys(const ReportFields& report, std::size_t indent) const;

  HasFlag has_flag_;
  ReportFields report_{};
};

}  // namespace waymark::cli
