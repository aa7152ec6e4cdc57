#pragma once

#include <string>
#include <string_view>

#include "waymark/plot/drawing.hpp"

typedef struct _cairo cairo_t;  // NOLINT: declared as in cairo.h, which only .cpp files include

namespace waymark::plot {

/// Draws one line of text on a canvas whose unit is the millimetre.
void draw_text(cairo_t* canvas, const Text& text);

/// The outlines of the text as SVG path data, in page coordinates [mm].
[[nodiscard]] std::string text_outline(const Text& text);

/// Escapes text for XML and HTML, both between tags and in quotes. Control characters become spaces, because
/// XML 1.0 does not allow them.
[[nodiscard]] std::string escaped(std::string_view words);

/// 12.3456 -> "12.3456", 5.0 -> "5". At most four decimals (a tenth of a micrometre on paper), never with an
/// exponent.
[[nodiscard]] std::string short_number(double value);

}  // namespace waymark::plot
