#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/plot/drawing.hpp"

namespace waymark::plot {

/// A mark on an axis.
struct Tick {
  double value = 0;
  std::string label;  ///< empty for minor ticks

  friend bool operator==(const Tick&, const Tick&) = default;
};

/// About `wanted` round numbers (multiples of 1, 2 or 5 times a power of ten) inside [low, high] (Heckbert,
/// "Nice numbers for graph labels", Graphics Gems, 1990). Requires low < high, both finite.
[[nodiscard]] std::vector<Tick> linear_ticks(double low, double high, int wanted);

/// Powers of ten inside [low, high], with their multiples as minor ticks. If there are fewer than two powers
/// of ten, their multiples by 2 and 5 are labelled as well. Requires 0 < low < high, both finite.
[[nodiscard]] std::vector<Tick> log_ticks(double low, double high);

/// Whether a point is inside the box or on its border. False for NaN.
[[nodiscard]] inline bool inside(const Point& point, const Box& box) {
  return point.x_mm >= box.x_mm && point.x_mm <= box.right_mm() && point.y_mm >= box.y_mm &&
         point.y_mm <= box.bottom_mm();
}

/// The parts of the line through these points that lie inside the box. A NaN point ends a part. Points less
/// than a fiftieth of a millimetre from the previous one are omitted, because the difference is invisible.
/// O(points). (Liang and Barsky, "A new concept and method for line clipping", ACM Transactions on Graphics
/// 3, 1984.)
[[nodiscard]] std::vector<std::vector<Point>> clipped_lines(const std::vector<Point>& points, const Box& box);

/// Line style of a series.
struct LineStyle {
  double width_mm = 0.4;
  std::vector<double> dash_mm{};  ///< lengths of dash, gap, dash, …; solid if empty
};

/// Text next to a point in a chart.
struct PointLabel {
  double x = 0;
  double y = 0;
  std::string text{};
};

/// Related points in a chart, in the units of its axes. A non-finite value creates a gap in the line.
struct Series {
  enum class Style { Line, Points, LineAndPoints };

  std::string name{};  ///< shown in the legend; not shown if empty
  std::vector<double> x{};
  std::vector<double> y{};  ///< same length as x
  Style style = Style::Line;
  std::optional<Color> color = {};     ///< by default, the next colour from kPalette
  std::optional<LineStyle> line = {};  ///< by default solid, and dashed once the colours repeat
  std::vector<PointLabel> labels = {};
};

/// An axis of a chart.
struct Axis {
  std::string label{};             ///< such as "size of the tag"
  std::string unit{};              ///< such as "px"; empty for dimensionless values
  std::optional<double> low = {};  ///< limits; by default, round numbers around the data
  std::optional<double> high = {};
  bool logarithmic = false;
};

/// A chart of lines and points in x and y.
struct Figure {
  std::string title{};
  Axis x{};
  Axis y{};
  std::vector<Series> series{};
  bool equal_scales = false;  ///< a unit has the same length in x and y, as needed for paths on the floor
  double width_mm = 160;
  double height_mm = 100;
};

/// Eight colours that are distinguishable with any kind of colour vision (Okabe and Ito, "Color Universal
/// Design", 2008). Those with the highest contrast on white paper come first. Additional series repeat the
/// colours with a different dash pattern and mark.
inline constexpr Color kPalette[] = {{0.0, 0.447, 0.698},   {0.835, 0.369, 0.0}, {0.0, 0.620, 0.451},
                                     {0.800, 0.475, 0.655}, {0.0, 0.0, 0.0},     {0.902, 0.624, 0.0},
                                     {0.337, 0.706, 0.914}};

/// Draws a figure with its title, legend, frame, ticks, units, and the series clipped to the frame. Pass the
/// result to render_svg, render_png or render_pdf. O(points). Errors: InvalidArgument if there is nothing
/// finite to draw, x and y have different lengths, or the figure is smaller than 40 x 30 mm. Limits in the
/// wrong order, or not positive on a logarithmic axis, are also errors.
[[nodiscard]] Result<Drawing> draw_figure(const Figure& figure);

}  // namespace waymark::plot
