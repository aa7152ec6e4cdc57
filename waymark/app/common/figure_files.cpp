#include "waymark/app/common/figure_files.hpp"

#include "waymark/codecs/image_file.hpp"
#include "waymark/plot/render.hpp"

namespace waymark {

Status write_figure(const std::filesystem::path& path, const plot::Figure& figure,
                    const std::vector<std::string>& suffixes, std::vector<std::string>& files) {
  constexpr double kDpi = 150;
  const Result<plot::Drawing> drawing = plot::draw_figure(figure);
  if (!drawing) return tl::unexpected(drawing.error());
  for (const std::string& suffix : suffixes) {
    const std::string file = std::filesystem::path(path).replace_extension(suffix).string();
    const Result<plot::FileFormat> format = plot::format_of(file);
    if (!format) return tl::unexpected(format.error());
    const Result<plot::Bytes> bytes = *format == plot::FileFormat::Pdf   ? plot::render_pdf({&*drawing, 1})
                                      : *format == plot::FileFormat::Svg ? plot::render_svg(*drawing)
                                                                         : plot::render_png(*drawing, kDpi);
    if (!bytes) return tl::unexpected(bytes.error());
    if (Status status = write_bytes(file, *bytes); !status) return status;
    files.push_back(file);
  }
  return {};
}

}  // namespace waymark
