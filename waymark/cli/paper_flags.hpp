#pragma once

#include <memory>
#include <string>

#include <CLI/App.hpp>

#include "waymark/base/error.hpp"
#include "waymark/cli/console.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/jobs/write_pages.hpp"
#include "waymark/plot/render.hpp"
#include "waymark/plot/sheet_layout.hpp"

namespace waymark::cli {

/// The flags that every verb with a printed page has: --family, --paper, --orientation, --dpi, --output,
/// --force, --json.
class PaperFlags {
 public:
  explicit PaperFlags(CLI::App& verb);

  /// Family, paper and orientation into options that have them; the output must be of a known kind.
  template <class Options>
  [[nodiscard]] Result<plot::FileFormat> apply(Options& options) const {
    const auto paper = plot::parse_paper(paper_);
    if (!paper) return tl::unexpected(paper.error());
    const auto orientation = plot::parse_orientation(orientation_);
    if (!orientation) return tl::unexpected(orientation.error());
    options.paper = *paper;
    options.orientation = *orientation;
    Result<plot::FileFormat> format = plot::format_of(output);
    if (!format || *format == plot::FileFormat::Png) return format;
    if (Status status = refuse_flag(app_, "--dpi", "only .png has a resolution", "Leave it out."); !status)
      return tl::unexpected(status.error());
    return format;
  }
  [[nodiscard]] Result<FamilyId> family() const;

  std::string output;
  double dpi = 300.0;
  bool json = false;
  bool force = false;

  /// Where the pages go.
  [[nodiscard]] PageFiles files(plot::FileFormat format) const { return {format, output, dpi, force}; }

 private:
  const CLI::App& app_;
  std::string family_ = "tag36h11";
  std::string paper_ = "A4";
  std::string orientation_ = "auto";
};

/// The flag --tag-size-m, without a default: a size has no usual value. Call after the option flags were
/// added.
CLI::Option* name_tag_size(CLI::App& app);

/// Fails unless a size was `given`, by the flag or otherwise, and on a flag that is no size, in words that
/// help who gave millimetres.
[[nodiscard]] Status check_tag_size(const CLI::Option& tag_size, bool given);

/// Says why a page was not written, and gives back the exit code.
[[nodiscard]] ExitCode fail_writing(const Error& error, Console& console);

/// What to do with the paper, for the end of every such verb.
inline constexpr const char* kPrintReminder =
    "Print at 100 % (no \"fit to page\") and measure the ruler on the page.";

}  // namespace waymark::cli
