#pragma once

#include <memory>
#include <string>

#include <CLI/App.hpp>

#include "waymark/base/error.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/plot/render.hpp"
#include "waymark/plot/sheet_layout.hpp"

namespace waymark::cli {

/// The flags that every verb with a printed page has: --family, --paper, --orientation, --dpi, --output,
/// --json.
class PaperFlags {
 public:
  explicit PaperFlags(CLI::App& app);

  /// Family, paper and orientation into options that have them; the output must be of a known kind.
  template <class Options>
  [[nodiscard]] Result<plot::FileFormat> apply(Options& options) const {
    const auto paper = plot::parse_paper(paper_);
    if (!paper) return tl::unexpected(paper.error());
    const auto orientation = plot::parse_orientation(orientation_);
    if (!orientation) return tl::unexpected(orientation.error());
    options.paper = *paper;
    options.orientation = *orientation;
    return plot::format_of(output);
  }
  [[nodiscard]] Result<FamilyId> family() const;

  std::string output;
  double dpi = 300.0;
  bool json = false;

 private:
  std::string family_ = "tag36h11";
  std::string paper_ = "A4";
  std::string orientation_ = "auto";
};

/// Makes --tag-size-m required: a size has no usual value. Call after the option flags were added.
CLI::Option* require_tag_size(CLI::App& app);

/// The given size as a size of a tag, in words that help who gave millimetres.
[[nodiscard]] Status check_tag_size(const CLI::Option& tag_size);

/// What to do with the paper, for the end of every such verb.
inline constexpr const char* kPrintReminder =
    "Print at 100 % (no \"fit to page\") and measure the ruler on the page.";

}  // namespace waymark::cli
