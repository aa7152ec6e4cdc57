#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/plot/drawing.hpp"

namespace waymark::plot {

using Bytes = std::vector<std::uint8_t>;

/// The output formats for a drawing. All are true to scale, and the same drawing always gives the same bytes.
enum class FileFormat : std::uint8_t { Pdf, Svg, Png };

/// The format for the suffix of a path, ".pdf", ".svg" or ".png" (case-insensitive). Error: InvalidArgument;
/// the hint lists these three.
[[nodiscard]] Result<FileFormat> format_of(std::string_view path);

/// One PDF with a page for each drawing. Text is stored as text. The file asks viewers not to scale it for
/// printing (ViewerPreferences, PrintScaling None: ISO 32000-1, table 150). Errors: InvalidArgument (no page,
/// or a page larger than 5 m).
[[nodiscard]] Result<Bytes> render_pdf(std::span<const Drawing> pages);

/// SVG 1.1 in which one user unit is a millimetre. Text is drawn as outlines, independently of installed
/// fonts, and labelled with the text itself.
[[nodiscard]] Result<Bytes> render_svg(const Drawing& page);

/// Antialiased RGB PNG at `dpi` pixels per inch. The resolution is recorded in the file so that it prints at
/// true size. The grey level of a pixel on an edge is proportional to its coverage. Errors: InvalidArgument
/// (dpi outside 10 … 2400), LimitExceeded (more than 200 megapixels).
[[nodiscard]] Result<Bytes> render_png(const Drawing& page, double dpi);

/// Length of a line of text drawn at this height; 0 for empty text.
[[nodiscard]] double text_length_mm(const std::string& words, double height_mm, bool bold);

}  // namespace waymark::plot
