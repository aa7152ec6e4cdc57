#include "waymark/app/tags/write_pages.hpp"

#include <filesystem>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/staged_folder.hpp"
#include "waymark/codecs/image_file.hpp"

namespace waymark {

std::string page_path(const std::string& path, std::size_t page, std::size_t pages) {
  if (pages == 1) return path;
  std::filesystem::path name(path);
  const std::size_t digits = std::to_string(pages).size();
  const std::string numbered =
      fmt::format("{}-{:0{}}{}", name.stem().string(), page, digits, name.extension().string());
  return name.replace_filename(numbered).string();
}

WrittenPages write_pages(const std::vector<plot::Drawing>& pages, const PageFiles& to,
                         const JobControl& control) {
  WrittenPages written;
  const plot::FileFormat format = to.format;
  const std::size_t files = format == plot::FileFormat::Pdf ? 1 : pages.size();
  for (std::size_t i = 0; i < files && written.status; ++i)
    written.status = check_new_file(page_path(to.path, i + 1, files), to.replace);
  const std::string target =
      std::filesystem::path(page_path(to.path, 1, files)).replace_extension(".yaml").string();
  if (written.status && !to.target.empty()) written.status = check_new_file(target, to.replace);
  if (!written.status) return written;
  for (std::size_t i = 0; i < files; ++i) {
    written.status = control.go_on();
    if (!written.status) return written;
    const std::string file = page_path(to.path, i + 1, files);
    control.progress({.words = file, .done = i, .all = files});
    const auto bytes = format == plot::FileFormat::Pdf   ? plot::render_pdf(pages)
                       : format == plot::FileFormat::Svg ? plot::render_svg(pages[i])
                                                         : plot::render_png(pages[i], to.dpi);
    written.status = bytes ? write_bytes(file, *bytes) : Status(tl::unexpected(bytes.error()));
    if (!written.status) return written;
    written.files.push_back(file);
  }
  if (to.target.empty()) return written;
  const std::vector<std::uint8_t> bytes(to.target.begin(), to.target.end());
  written.status = write_bytes(target, bytes);
  if (written.status) written.files.push_back(target);
  return written;
}

}  // namespace waymark
