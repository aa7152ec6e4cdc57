#pragma once

#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "waymark/app/cli/console.hpp"
#include "waymark/app/cli/flags.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/tags/tag_prints.hpp"
#include "waymark/base/error.hpp"

namespace waymark::cli {

/// Flags for verbs that write printable pages: --family, --paper, --orientation, --dpi, --output, --force,
/// --json.
class PaperFlags {
 public:
  explicit PaperFlags(CLI::App& verb);

  /// Sets the paper and the orientation in `options`. Fails if the output format is unknown.
  template <class Options>
  [[nodiscard]] Status apply(Options& options) const {
    if (Status status = apply_paper(request_, options); !status) return status;
    Refusals refused(app_);
    refused.fields(plot::format_of(request_.files.path) != plot::FileFormat::Png, {"--dpi"},
                   "only .png has a resolution", "Omit --dpi.");
    return refused.status();
  }
  [[nodiscard]] Result<FamilyId> family() const { return requested_family(request_); }

  /// Call after apply(). Writes the pages of a layout to their files, prints the report, and then prints the
  /// note `words`. `target` is PageFiles::target.
  template <class Layout>
  [[nodiscard]] ExitCode write(const Layout& layout, const std::vector<plot::Drawing>& pages,
                               Console& console, const std::string& words = {},
                               const std::string& target = {}) const {
    PageFiles files = request_.files;
    files.format = *plot::format_of(files.path);
    files.target = target;
    const WrittenPages written = write_pages(pages, files, control_from(console));
    if (json_) console.print(json_line(fields(Printed<Layout>{layout, written.files})));
    if (!written.status) return fail_writing(written.status.error(), console);
    if (!json_) console.print(to_text(layout, written.files));
    if (!words.empty()) console.note(words);
    console.note("Print at 100 % (no \"fit to page\") and measure the ruler on the page.");
    return ExitCode::Ok;
  }

 private:
  /// Prints why a page was not written and returns the exit code.
  [[nodiscard]] static ExitCode fail_writing(const Error& error, Console& console);

  const CLI::App& app_;
  PageRequest request_{};
  bool json_ = false;
};

/// Shows --tag-size-m as a required flag without a default. Call after the option flags have been added.
CLI::Option* name_tag_size(CLI::App& app);

/// Fails unless a size was set, by the flag or otherwise (`given`), and if the size is invalid. The message
/// also helps users who entered millimetres.
[[nodiscard]] Status check_tag_size(const CLI::Option& tag_size, bool given);

}  // namespace waymark::cli
