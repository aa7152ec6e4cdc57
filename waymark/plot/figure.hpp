#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/plot/drawing.hpp"

namespace waymark::plot {

/// How the line of a series is drawn.
struct LineStyle {
  double width_mm = 0.4;
  std::vector<double> dash_mm{};  ///< lengths of dash, gap, dash, …; empty: solid
};

/// Words beside a point of a chart.
struct PointLabel {
  double x = 0;
  double y = 0;
  std::string text{};
};

/// Points of a chart that belong together, in the units of its axes. Where a value is not finite, the line
/// has a gap.
struct Series {
  enum class Style { Line, Points, LineAndPoints };

  std::string name{};  ///< in the legend; empty: not in it
  std::vector<double> x{};
  std::vector<double> y{};  ///< as many as x
  Style style = Style::Line;
  std::optional<Color> color = {};     ///< otherwise the next of kPalette
  std::optional<LineStyle> line = {};  ///< otherwise solid, and dashed where the colours of kPalette repeat
  std::vector<PointLabel> labels = {};
};

/// What an axis shows.
struct Axis {
  std::string label{};             ///< "size of the tag"
  std::string unit{};              ///< "px"; empty for pure numbers
  std::optional<double> low = {};  ///< where it begins and ends; otherwise round numbers around the data
  std::optional<double> high = {};
  bool logarithmic = false;
};

/// A chart of lines and points in x and y.
struct Figure {
  std::string title{};
  Axis x{};
  Axis y{};
  std::vector<Series> series{};
  bool equal_scales = false;  ///< a metre in x is as long as a metre in y: for paths on the floor
  double width_mm = 160;
  double height_mm = 100;
};

/// Eight colours that people of all kinds of colour vision tell apart (Okabe and Ito, "Color Universal
/// Design", 2008), those with the most contrast to white paper first. Series beyond them begin again, with
/// another dash and mark.
inline constexpr Color kPalette[] = {{0.0, 0.447, 0.698},   {0.835, 0.369, 0.0}, {0.0, 0.620, 0.451},
                                     {0.800, 0.475, 0.655}, {0.0, 0.0, 0.0},     {0.902, 0.624, 0.0},
                                     {0.337, 0.706, 0.914}};

/// Draws it: title, legend, frame with ticks and units, series clipped to the frame. The result goes to
/// render_svg, render_png or render_pdf. O(points). Errors: InvalidArgument (nothing finite to draw, x and y
/// of different length, limits the wrong way round or not positive on a logarithmic axis, a figure smaller
/// than 40 x 30 mm).
[[nodiscard]] Result<Drawing> draw_figure(const Figure& figure);

}  // namespace waymark::plot
