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
/// "Nice numbers for graph labels", Graphics Gems, 1990). low < high, both finite.
[[nodiscard]] std::vector<Tick> linear_ticks(double low, double high, int wanted);

/// Powers of ten inside [low, high] with their multiples as minor ticks. With fewer than two powers, 2 and 5
/// times them are labelled as well. Requires 0 < low < high, both finite.
[[nodiscard]] std::vector<Tick> log_ticks(double low, double high);

/// Whether a point is in the box, including its border. False for NaN.
[[nodiscard]] inline bool inside(const Point& point, const Box& box) {
  return point.x_mm >= box.x_mm && point.x_mm <= box.right_mm() && point.y_mm >= box.y_mm &&
         point.y_mm <= box.bottom_mm();
}

/// The parts of a line through these points that are inside the box. A NaN point ends a part. Points nearer
/// than a fiftieth of a millimetre to the previous one are omitted, because the difference is invisible.
/// O(points). (Liang and Barsky, "A new concept and method for line clipping", ACM Transactions on Graphics
/// 3, 1984.)
[[nodiscard]] std::vector<std::vector<Point>> clipped_lines(const std::vector<Point>& points, const Box& box);

/// Style of the line of a series.
struct LineStyle {
  double width_mm = 0.4;
  std::vector<double> dash_mm{};  ///< lengths of dash, gap, dash, …; empty: solid
};

/// Text next to a point of a chart.
struct PointLabel {
  double x = 0;
  double y = 0;
  std::string text{};
};

/// Related points of a chart, in the units of its axes. A non-finite value makes a gap in the line.
struct Series {
  enum class Style { Line, Points, LineAndPoints };

  std::string name{};  ///< shown in the legend; empty: not shown
  std::vector<double> x{};
  std::vector<double> y{};  ///< as many as x
  Style style = Style::Line;
  std::optional<Color> color = {};     ///< otherwise the next of kPalette
  std::optional<LineStyle> line = {};  ///< default: solid, and dashed after the colours of kPalette repeat
  std::vector<PointLabel> labels = {};
};

/// An axis of a chart.
struct Axis {
  std::string label{};             ///< "size of the tag"
  std::string unit{};              ///< "px"; empty for dimensionless values
  std::optional<double> low = {};  ///< limits; default: round numbers around the data
  std::optional<double> high = {};
  bool logarithmic = false;
};

/// A chart of lines and points in x and y.
struct Figure {
  std::string title{};
  Axis x{};
  Axis y{};
  std::vector<Series> series{};
  bool equal_scales = false;  ///< a unit has the same length in x and y, as for paths on the floor
  double width_mm = 160;
  double height_mm = 100;
};

/// Eight colours that are distinguishable with all kinds of colour vision (Okabe and Ito, "Color Universal
/// Design", 2008). Those with the most contrast to white paper come first. Further series repeat the colours
/// with another dash and mark.
inline constexpr Color kPalette[] = {{0.0, 0.447, 0.698},   {0.835, 0.369, 0.0}, {0.0, 0.620, 0.451},
                                     {0.800, 0.475, 0.655}, {0.0, 0.0, 0.0},     {0.902, 0.624, 0.0},
                                     {0.337, 0.706, 0.914}};

/// Draws a figure: title, legend, frame with ticks and units, series clipped to the frame. Pass the result to
/// render_svg, render_png or render_pdf. O(points). Errors: InvalidArgument for nothing finite to draw, x and
/// y of different length, or a figure smaller than 40 x 30 mm. Also for limits in the wrong order, or not
/// positive on a logarithmic axis.
[[nodiscard]] Result<Drawing> draw_figure(const Figure& figure);

}  // namespace waymark::plot
