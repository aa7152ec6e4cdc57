#include "waymark/cli/page_files.hpp"

#include <filesystem>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/codecs/image_file.hpp"

namespace waymark::cli {

std::string page_path(const std::string& path, std::size_t page, std::size_t pages) {
  if (pages == 1) return path;
  std::filesystem::path name(path);
  const std::size_t digits = std::to_string(pages).size();
  const std::string numbered =
      fmt::format("{}-{:0{}}{}", name.stem().string(), page, digits, name.extension().string());
  return name.replace_filename(numbered).string();
}

WrittenPages write_pages(const std::vector<plot::Drawing>& pages, plot::FileFormat format,
                         const std::string& path, double dpi, Console& console) {
  WrittenPages written;
  const std::size_t files = format == plot::FileFormat::Pdf ? 1 : pages.size();
  for (std::size_t i = 0; i < files; ++i) {
    if (interrupted()) {
      written.code = ExitCode::Interrupted;
      return written;
    }
    const std::string file = page_path(path, i + 1, files);
    console.progress(i, files, file);
    const auto bytes = format == plot::FileFormat::Pdf   ? plot::render_pdf(pages)
                       : format == plot::FileFormat::Svg ? plot::render_svg(pages[i])
                                                         : plot::render_png(pages[i], dpi);
    const Status saved = bytes ? write_bytes(file, *bytes) : Status(tl::unexpected(bytes.error()));
    if (!saved) {
      console.say(naming_flag(saved.error()));
      written.code = saved.error().code == ErrorCode::Unwritable ? ExitCode::SomeFailed : ExitCode::Usage;
      return written;
    }
    written.files.push_back(file);
  }
  return written;
}

Error naming_flag(Error error) {
  if (error.place.source.empty() && !error.place.key.empty() && !error.place.key.starts_with('-'))
    error.place.key = flag_name(error.place.key);
  return error;
}

ExitCode exit_code_of(const Error& error) {
  if (interrupted()) return ExitCode::Interrupted;
  return error.place.key.starts_with("--") ? ExitCode::Usage : ExitCode::SomeFailed;
}

}  // namespace waymark::cli
