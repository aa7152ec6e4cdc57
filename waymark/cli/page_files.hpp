#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/cli/console.hpp"
#include "waymark/plot/render.hpp"

namespace waymark::cli {

/// What was written, and how it ended.
struct WrittenPages {
  std::vector<std::string> files;
  ExitCode code = ExitCode::Ok;
};

/// The file of one page of many: "tags-07.png" is page 7 of 24 of "tags.png". The only page keeps the name.
[[nodiscard]] std::string page_path(const std::string& path, std::size_t page, std::size_t pages);

/// Writes pages to one PDF, or to an SVG or PNG each (PNG with `dpi`). Says what fails and stops there.
[[nodiscard]] WrittenPages write_pages(const std::vector<plot::Drawing>& pages, plot::FileFormat format,
                                       const std::string& path, double dpi, Console& console);

/// The error with the flag that sets its key, as people type it: "(--tag-size-m): …". One with a place in a
/// file stays as it is.
[[nodiscard]] Error naming_flag(Error error);

/// 130 after Ctrl-C, 2 for what the command line says (the error's key is a flag), 1 for a file that is not
/// usable or could not be written.
[[nodiscard]] ExitCode exit_code_of(const Error& error);

}  // namespace waymark::cli
