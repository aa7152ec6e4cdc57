#pragma once

#include <string>
#include <string_view>

#include "waymark/plot/drawing.hpp"

typedef struct _cairo cairo_t;  // NOLINT: declared as in cairo.h, which only .cpp files include

namespace waymark::plot {

/// Draws one line of text on a canvas whose unit is the millimetre.
void draw_text(cairo_t* canvas, const Text& text);

/// The outlines of the text as SVG path data, in millimetres of the page.
[[nodiscard]] std::string text_outline(const Text& text);

/// Escaped for XML and HTML, between tags and in quotes; XML 1.0 has no control characters.
[[nodiscard]] std::string escaped(std::string_view words);

/// 12.3456 -> "12.3456", 5.0 -> "5". At most four decimals (a tenth of a micrometre on paper), never an
/// exponent.
[[nodiscard]] std::string short_number(double value);

}  // namespace waymark::plot
