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

/// The flags that every verb with a printed page has: --family, --paper, --orientation, --dpi, --output,
/// --force, --json.
class PaperFlags {
 public:
  explicit PaperFlags(CLI::App& verb);

  /// Paper and orientation into options that have them; the output must be of a known kind.
  template <class Options>
  [[nodiscard]] Status apply(Options& options) const {
    if (Status status = describe_paper(said_, options); !status) return status;
    Refusals refused(app_);
    refused.flags(plot::format_of(said_.files.path) != plot::FileFormat::Png, {"--dpi"},
                  "only .png has a resolution", "Leave it out.");
    return refused.status();
  }
  [[nodiscard]] Result<FamilyId> family() const { return described_family(said_); }

  /// After apply(): draws the pages of a layout into their files and says so, with what is to be said of them
  /// (`words`). `target`: PageFiles::target.
  template <class Layout>
  [[nodiscard]] ExitCode write(const Layout& layout, const std::vector<plot::Drawing>& pages,
                               Console& console, const std::string& words = {},
                               const std::string& target = {}) const {
    PageFiles files = said_.files;
    files.format = *plot::format_of(files.path);
    files.target = target;
    const WrittenPages written = write_pages(pages, files, control_from(console));
    if (json_) console.print(json_line(fields(Printed<Layout>{layout, written.files})));
    if (!written.status) return fail_writing(written.status.error(), console);
    if (!json_) console.print(to_text(layout, written.files));
    if (!words.empty()) console.say(words);
    console.say("Print at 100 % (no \"fit to page\") and measure the ruler on the page.");
    return ExitCode::Ok;
  }

 private:
  /// Says why a page was not written, and gives back the exit code.
  [[nodiscard]] static ExitCode fail_writing(const Error& error, Console& console);

  const CLI::App& app_;
  PaperDescription said_{};
  bool json_ = false;
};

/// The flag --tag-size-m, without a default: a size has no usual value. Call after the option flags were
/// added.
CLI::Option* name_tag_size(CLI::App& app);

/// Fails unless a size was `given`, by the flag or otherwise, and on a flag that is no size, in words that
/// help who gave millimetres.
[[nodiscard]] Status check_tag_size(const CLI::Option& tag_size, bool given);

}  // namespace waymark::cli
