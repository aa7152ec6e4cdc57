#pragma once
// Inside the room: the marks that tag sheets and calibration boards share.

#include <string>
#include <vector>

#include "waymark/plot/drawing.hpp"
#include "waymark/plot/sheet_layout.hpp"

namespace waymark::plot {

inline constexpr Color kMarkColor{0.25, 0.25, 0.25};   ///< of words, arrows and the ruler
inline constexpr Color kFaintColor{0.55, 0.55, 0.55};  ///< of cut lines and side remarks

/// Room for rounding in comparisons of lengths.
inline constexpr double kToleranceMm = 1e-6;

/// 160 -> "160 mm", 24.69 -> "24.69 mm": what a ruler can show, to a hundredth.
[[nodiscard]] std::string millimetres(double length_mm);

/// Height of the footer strip; its place on a page.
inline constexpr double kFooterHeightMm = 15.0;
[[nodiscard]] Footer place_footer(const Paper& paper, double margin_mm);

/// The ruler with its ticks and the words that go with it; `remark` is the last line.
void draw_footer(const Footer& footer, const std::string& remark, std::vector<Shape>& shapes);

/// An arrow between the x positions `from_mm` and `to_mm` inside a strip, with words in its middle, or to its
/// right where they would be too small otherwise and the strip has room for them.
void draw_dimension(double from_mm, double to_mm, const Box& strip, const std::string& words,
                    std::vector<Shape>& shapes);

/// A triangle that points to the upper edge, filling the box.
void draw_up_mark(const Box& box, std::vector<Shape>& shapes);

}  // namespace waymark::plot
