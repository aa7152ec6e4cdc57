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

/// The output formats of a drawing. All are true to scale, and the same drawing gives the same bytes.
enum class FileFormat : std::uint8_t { Pdf, Svg, Png };

/// The format for a path's suffix, in any case: ".pdf", ".svg", ".png". Error: InvalidArgument, with these
/// three as hint.
[[nodiscard]] Result<FileFormat> format_of(std::string_view path);

/// One PDF with a page per drawing. Text stays text. The file requests that viewers do not scale it when
/// printing (ViewerPreferences, PrintScaling None: ISO 32000-1, table 150). Errors: InvalidArgument (no page,
/// a page larger than 5 m).
[[nodiscard]] Result<Bytes> render_pdf(std::span<const Drawing> pages);

/// SVG 1.1 with one user unit per millimetre. Text is drawn as outlines, independent of installed fonts, with
/// the text as label.
[[nodiscard]] Result<Bytes> render_svg(const Drawing& page);

/// Antialiased RGB PNG at `dpi` pixels per inch, which are recorded in the file so that it prints in true
/// size. A pixel on an edge is grey in proportion to its coverage. Errors: InvalidArgument (dpi outside 10 …
/// 2400), LimitExceeded (more than 200 megapixels).
[[nodiscard]] Result<Bytes> render_png(const Drawing& page, double dpi);

/// Length of a line of text drawn at this height. 0 for empty text.
[[nodiscard]] double text_length_mm(const std::string& words, double height_mm, bool bold);

}  // namespace waymark::plot
