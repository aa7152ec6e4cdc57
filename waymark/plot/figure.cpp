#include "waymark/plot/figure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "waymark/plot/render.hpp"

namespace waymark::plot {
namespace {

double power_of_ten(int exponent) { return std::pow(10.0, exponent); }

/// The smallest step of 1, 2 or 5 times a power of ten that is not below `raw`.
double nice_step(double raw) {
  const double power = power_of_ten(static_cast<int>(std::floor(std::log10(raw))));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw * (1 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

/// Formats a value with as many decimals as the step has, or with an exponent if the text would be long.
std::string label_of(double value, double step) {
  if (value == 0.0) return "0";
  const double size = std::abs(value);
  if (size >= 1e6 || step < 1e-5) return fmt::format("{:.6g}", value);
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  return fmt::format("{:.{}f}", value, decimals);
}

std::vector<Tick> ticks_every(double step, double low, double high, int wanted) {
  std::vector<Tick> ticks;
  if (!(step > 0.0) || !std::isfinite(step)) return ticks;
  const double slack = 1e-9 * (high - low);
  const double first = std::ceil((low - slack) / step);
  for (int i = 0; i <= 4 * wanted + 10; ++i) {
    const double value = (first + i) * step;
    if (value > high + slack) break;
    ticks.push_back({value, label_of(value, step)});
  }
  return ticks;
}

}  // namespace

std::vector<Tick> linear_ticks(double low, double high, int wanted) {
  const double raw = (high - low) / std::max(1, wanted);
  std::vector<Tick> ticks = ticks_every(nice_step(raw), low, high, wanted);
  // A range of four may contain no multiple of five, but it contains one of the next finer step.
  if (ticks.empty()) ticks = ticks_every(nice_step(nice_step(raw) / 2.5), low, high, wanted);
  return ticks;
}

std::vector<Tick> log_ticks(double low, double high) {
  const int first = static_cast<int>(std::floor(std::log10(low)));
  const int last = static_cast<int>(std::floor(std::log10(high)));
  const bool few = last - first < 2;
  std::vector<Tick> ticks;
  for (int exponent = first; exponent <= last; ++exponent) {
    for (int factor = 1; factor <= 9; ++factor) {
      const double value = factor * power_of_ten(exponent);
      if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) continue;
      const bool labelled = factor == 1 || (few && (factor == 2 || factor == 5));
      ticks.push_back({value, labelled ? fmt::format("{:g}", value) : std::string()});
    }
  }
  return ticks;
}

namespace {

constexpr double kInvisibleMm = 0.02;

/// The part of a segment inside the box; `nullopt` if there is none.
std::optional<std::pair<Point, Point>> clipped(const Point& a, const Point& b, const Box& box) {
  const double dx = b.x_mm - a.x_mm;
  const double dy = b.y_mm - a.y_mm;
  double enters = 0.0;
  double leaves = 1.0;
  const std::array<std::pair<double, double>, 4> sides = {{{-dx, a.x_mm - box.x_mm},
                                                           {dx, box.right_mm() - a.x_mm},
                                                           {-dy, a.y_mm - box.y_mm},
                                                           {dy, box.bottom_mm() - a.y_mm}}};
  for (const auto& [towards, room] : sides) {
    if (towards == 0.0 && room < 0.0) return std::nullopt;
    if (towards < 0.0) enters = std::max(enters, room / towards);
    if (towards > 0.0) leaves = std::min(leaves, room / towards);
  }
  if (!(enters <= leaves)) return std::nullopt;
  const auto at = [&](double share) { return Point{a.x_mm + share * dx, a.y_mm + share * dy}; };
  return std::pair(enters > 0.0 ? at(enters) : a, leaves < 1.0 ? at(leaves) : b);
}

bool apart(const Point& a, const Point& b) {
  return std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm) >= kInvisibleMm;
}

bool known(const Point& point) { return std::isfinite(point.x_mm) && std::isfinite(point.y_mm); }

}  // namespace

std::vector<std::vector<Point>> clipped_lines(const std::vector<Point>& points, const Box& box) {
  std::vector<std::vector<Point>> parts;
  std::optional<Point> last;  // the current point, on or off the page
  bool drawing = false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& next = points[i];
    if (!known(next)) {
      last.reset();
      drawing = false;
      continue;
    }
    const bool ends = i + 1 == points.size() || !known(points[i + 1]);
    if (last && !ends && !apart(*last, next)) continue;
    if (last) {
      const auto segment = clipped(*last, next, box);
      if (segment && !drawing) parts.push_back({segment->first});
      if (segment) parts.back().push_back(segment->second);
      drawing = segment && segment->second == next;
    }
    last = next;
  }
  return parts;
}

namespace {

constexpr double kTextMm = 3.0;
constexpr double kTitleMm = 3.8;
constexpr double kLabelMm = 2.4;
constexpr double kGapMm = 1.5;
constexpr double kTickMm = 1.4;
constexpr double kMarkMm = 0.8;  // half the width of a mark
constexpr Color kFrameColor{0.25, 0.25, 0.25};
constexpr Color kGridColor{0.88, 0.88, 0.88};

/// An axis with fixed limits, which maps values to positions.
struct Scale {
  double low = 0, high = 1;  ///< in the unit of the axis, or its log10
  double from_mm = 0, to_mm = 1;
  bool logarithmic = false;

  [[nodiscard]] double linear(double value) const { return logarithmic ? std::log10(value) : value; }
  [[nodiscard]] double place_mm(double value) const {
    return from_mm + (linear(value) - low) / (high - low) * (to_mm - from_mm);
  }
  [[nodiscard]] bool shows(double value) const {
    return std::isfinite(value) && (!logarithmic || value > 0.0);
  }
};

struct Look {
  Color color;
  LineStyle line;
  int mark = 0;
};

Look look_of(const Figure& figure, std::size_t index) {
  constexpr std::size_t kColors = std::size(kPalette);
  const std::array<std::vector<double>, 3> dashes = {std::vector<double>{}, {2.0, 1.0}, {0.6, 0.8}};
  const Series& series = figure.series[index];
  const LineStyle line{.dash_mm = dashes.at(index / kColors % dashes.size())};
  return {series.color.value_or(kPalette[index % kColors]), series.line.value_or(line),
          static_cast<int>(index % 3)};
}

std::string with_unit(const Axis& axis) {
  return axis.unit.empty() ? axis.label : fmt::format("{} [{}]", axis.label, axis.unit);
}

Status check_axis(const Axis& axis, const char* key) {
  for (const auto& limit : {axis.low, axis.high}) {
    if (!limit) continue;
    if (!std::isfinite(*limit)) return fail(ErrorCode::InvalidArgument, "non-finite limit", {.key = key});
    if (axis.logarithmic && *limit <= 0.0)
      return fail(ErrorCode::InvalidArgument, "the lower limit of a logarithmic axis must be above 0",
                  {.key = key});
  }
  if (axis.low && axis.high && *axis.low >= *axis.high) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("invalid limits from {} to {}", *axis.low, *axis.high), {.key = key},
                "Set the lower limit first.");
  }
  return {};
}

/// The limits of an axis: those specified or, by default, those of the data with some margin; a constant line
/// is centred.
Result<Scale> scale_for(const Axis& axis, const Figure& figure, const std::vector<double> Series::*values,
                        const char* key) {
  if (const Status sane = check_axis(axis, key); !sane) return tl::unexpected<Error>(sane.error());
  Scale scale{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(), 0, 1,
              axis.logarithmic};
  for (const Series& series : figure.series) {
    for (const double value : series.*values) {
      if (!scale.shows(value)) continue;
      scale.low = std::min(scale.low, scale.linear(value));
      scale.high = std::max(scale.high, scale.linear(value));
    }
  }
  if (scale.low > scale.high)
    return fail(ErrorCode::InvalidArgument, "no finite value to draw", {.key = key},
                "Pass at least one finite point.");
  const double flat = std::max(std::abs(scale.low), 1.0) * 1e-9;
  const double air = scale.high - scale.low > flat ? 0.04 * (scale.high - scale.low)
                                                   : std::max(0.5 * std::abs(scale.low), 0.5);
  scale.low = axis.low ? scale.linear(*axis.low) : scale.low - air;
  scale.high = axis.high ? scale.linear(*axis.high) : scale.high + air;
  if (!(scale.low < scale.high) || !std::isfinite(scale.high - scale.low)) {
    return fail(ErrorCode::InvalidArgument,
                "the range of the values is empty within the limits, or too large", {.key = key},
                "Set both limits of the axis, or none.");
  }
  return scale;
}

/// Widens one of two axes about its middle so that a unit has the same length on both.
void equalise(Scale& x, Scale& y) {
  const double x_unit = std::abs(x.to_mm - x.from_mm) / (x.high - x.low);
  const double y_unit = std::abs(y.to_mm - y.from_mm) / (y.high - y.low);
  Scale& wide = x_unit > y_unit ? x : y;
  const double more =
      (wide.high - wide.low) * (std::max(x_unit, y_unit) / std::min(x_unit, y_unit) - 1.0) / 2;
  wide.low -= more;
  wide.high += more;
}

std::vector<Tick> ticks_of(const Scale& scale, double room_mm) {
  if (scale.logarithmic) return log_ticks(std::pow(10.0, scale.low), std::pow(10.0, scale.high));
  return linear_ticks(scale.low, scale.high,
                      std::max(2, static_cast<int>(std::abs(scale.to_mm - scale.from_mm) / room_mm)));
}

double widest_label_mm(const std::vector<Tick>& ticks) {
  double widest_mm = 0.0;
  for (const Tick& tick : ticks) widest_mm = std::max(widest_mm, text_length_mm(tick.label, kTextMm, false));
  return widest_mm;
}

Fill mark(Point at, int kind, Color color) {
  constexpr std::array<int, 3> kSides = {16, 4, 3};
  const int sides = kSides.at(static_cast<std::size_t>(kind));
  const double radius_mm = kMarkMm * (sides == 16 ? 1.0 : 1.3);
  const double turn = sides == 4 ? std::numbers::pi / 4 : -std::numbers::pi / 2;
  Fill fill{{{}}, color};
  for (int i = 0; i < sides; ++i) {
    const double angle = turn + 2 * std::numbers::pi * i / sides;
    fill.loops.front().push_back(
        {at.x_mm + radius_mm * std::cos(angle), at.y_mm + radius_mm * std::sin(angle)});
  }
  return fill;
}

void draw_axes(const Figure& figure, const Scale& x, const Scale& y, const Box& frame,
               std::vector<Shape>& shapes) {
  shapes.emplace_back(Group{"axes"});
  const auto line = [&](Point from, Point to, double width_mm, Color color) {
    shapes.emplace_back(Stroke{{from, to}, width_mm, color, {}});
  };
  const auto words = [&](const std::string& text, Point at, Align align, double room_mm) {
    shapes.emplace_back(Text{text, at, kTextMm, room_mm, align, false, false, kFrameColor});
  };
  for (const Tick& tick : ticks_of(x, 16.0)) {
    const double at_mm = x.place_mm(tick.value);
    if (!tick.label.empty()) line({at_mm, frame.y_mm}, {at_mm, frame.bottom_mm()}, 0.15, kGridColor);
    line({at_mm, frame.bottom_mm()}, {at_mm, frame.bottom_mm() + (tick.label.empty() ? 0.5 : 1.0) * kTickMm},
         0.2, kFrameColor);
    words(tick.label, {at_mm, frame.bottom_mm() + kTickMm + kTextMm}, Align::Middle, 24.0);
  }
  for (const Tick& tick : ticks_of(y, 10.0)) {
    const double at_mm = y.place_mm(tick.value);
    if (!tick.label.empty()) line({frame.x_mm, at_mm}, {frame.right_mm(), at_mm}, 0.15, kGridColor);
    line({frame.x_mm - (tick.label.empty() ? 0.5 : 1.0) * kTickMm, at_mm}, {frame.x_mm, at_mm}, 0.2,
         kFrameColor);
    words(tick.label, {frame.x_mm - kTickMm - 0.5, at_mm + 0.36 * kTextMm}, Align::Right, frame.x_mm);
  }
  const Point corners[] = {{frame.x_mm, frame.y_mm},
                           {frame.right_mm(), frame.y_mm},
                           {frame.right_mm(), frame.bottom_mm()},
                           {frame.x_mm, frame.bottom_mm()}};
  for (int i = 0; i < 4; ++i) line(corners[i], corners[(i + 1) % 4], 0.25, kFrameColor);
  words(with_unit(figure.x), {frame.middle_x_mm(), figure.height_mm - kGapMm}, Align::Middle, frame.width_mm);
  shapes.emplace_back(Text{with_unit(figure.y),
                           {kGapMm + kTextMm * 0.8, frame.middle_y_mm()},
                           kTextMm,
                           frame.height_mm,
                           Align::Middle,
                           false,
                           true,
                           kFrameColor});
}

void draw_series(const Series& series, const Look& look, const Scale& x, const Scale& y, const Box& frame,
                 std::vector<Shape>& shapes) {
  std::vector<Point> places;  // NaN for a missing point, where the line is interrupted
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const bool there = x.shows(series.x[i]) && y.shows(series.y[i]);
    const double nowhere = std::numeric_limits<double>::quiet_NaN();
    places.push_back(there ? Point{x.place_mm(series.x[i]), y.place_mm(series.y[i])}
                           : Point{nowhere, nowhere});
  }
  shapes.emplace_back(Group{series.name.empty() ? "series" : series.name});
  if (series.style != Series::Style::Points) {
    for (auto& part : clipped_lines(places, frame))
      shapes.emplace_back(Stroke{std::move(part), look.line.width_mm, look.color, look.line.dash_mm});
  }
  if (series.style != Series::Style::Line) {
    for (const Point& place : places) {
      if (inside(place, frame)) shapes.emplace_back(mark(place, look.mark, look.color));
    }
  }
  for (const PointLabel& label : series.labels) {
    if (!x.shows(label.x) || !y.shows(label.y)) continue;
    const Point at{x.place_mm(label.x), y.place_mm(label.y)};
    if (inside(at, frame))
      shapes.emplace_back(Text{label.text,
                               {at.x_mm, at.y_mm + 0.36 * kLabelMm},
                               kLabelMm,
                               12.0,
                               Align::Middle,
                               false,
                               false,
                               look.color});
  }
}

/// Draws the named series in rows from `top_mm` downwards and returns their height. Draws nothing if `shapes`
/// is null.
double legend(const Figure& figure, double top_mm, double left_mm, std::vector<Shape>* shapes) {
  constexpr double kKeyMm = 7.0;
  const double row_mm = kTextMm * 1.5;
  double x_mm = left_mm;
  double y_mm = top_mm;
  bool any = false;
  for (std::size_t i = 0; i < figure.series.size(); ++i) {
    const Series& series = figure.series[i];
    if (series.name.empty()) continue;
    const double words_mm = std::min(text_length_mm(series.name, kTextMm, false),
                                     figure.width_mm - left_mm - kKeyMm - 2 * kGapMm);
    if (any && x_mm + kKeyMm + words_mm > figure.width_mm - kGapMm) {
      x_mm = left_mm;
      y_mm += row_mm;
    }
    any = true;
    if (shapes != nullptr) {
      const Look look = look_of(figure, i);
      const double middle_mm = y_mm + row_mm / 2;
      if (series.style != Series::Style::Points)
        shapes->emplace_back(Stroke{{{x_mm, middle_mm}, {x_mm + kKeyMm - 1.5, middle_mm}},
                                    look.line.width_mm,
                                    look.color,
                                    look.line.dash_mm});
      if (series.style != Series::Style::Line)
        shapes->emplace_back(mark({x_mm + (kKeyMm - 1.5) / 2, middle_mm}, look.mark, look.color));
      shapes->emplace_back(Text{series.name,
                                {x_mm + kKeyMm, middle_mm + 0.36 * kTextMm},
                                kTextMm,
                                words_mm,
                                Align::Left,
                                false,
                                false,
                                kFrameColor});
    }
    x_mm += kKeyMm + words_mm + 4.0;
  }
  return any ? y_mm + row_mm - top_mm : 0.0;
}

Status check_figure(const Figure& figure) {
  if (!(figure.width_mm >= 40.0 && figure.height_mm >= 30.0 && figure.width_mm <= 2000.0 &&
        figure.height_mm <= 2000.0)) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("invalid figure size {} x {} mm", figure.width_mm, figure.height_mm), {},
                "Use 40 x 30 mm to 2 x 2 m.");
  }
  for (const Series& series : figure.series) {
    if (series.x.size() == series.y.size()) continue;
    return fail(ErrorCode::InvalidArgument, fmt::format("series '{}' has {} x values and {} y values",
                                                        series.name, series.x.size(), series.y.size()));
  }
  return {};
}

}  // namespace

Result<Drawing> draw_figure(const Figure& figure) {
  if (const Status sane = check_figure(figure); !sane) return tl::unexpected<Error>(sane.error());
  auto x = scale_for(figure.x, figure, &Series::x, "x");
  if (!x) return tl::unexpected<Error>(x.error());
  auto y = scale_for(figure.y, figure, &Series::y, "y");
  if (!y) return tl::unexpected<Error>(y.error());

  const double title_mm = figure.title.empty() ? kGapMm : kTitleMm * 1.6 + kGapMm;
  const double label_mm = kGapMm + kTextMm * 1.4;
  y->from_mm = figure.height_mm - label_mm - kTextMm - kTickMm - kGapMm;
  y->to_mm = title_mm;
  x->from_mm = label_mm + kTickMm + 1.0 + widest_label_mm(ticks_of(*y, 10.0));
  x->to_mm = figure.width_mm - 4 * kGapMm;
  y->to_mm = title_mm + legend(figure, title_mm, x->from_mm, nullptr) + kGapMm;
  if (figure.equal_scales && !x->logarithmic && !y->logarithmic) equalise(*x, *y);
  const Box frame{x->from_mm, y->to_mm, x->to_mm - x->from_mm, y->from_mm - y->to_mm};
  if (frame.width_mm < 10.0 || frame.height_mm < 10.0) {
    return fail(ErrorCode::InvalidArgument, "title, legend and labels leave no room for the chart", {},
                "Make the figure larger or the legend shorter.");
  }

  Drawing drawing{figure.width_mm, figure.height_mm, figure.title, {}};
  drawing.shapes.emplace_back(
      Text{figure.title,
           {frame.middle_x_mm(), kGapMm + kTitleMm},
           kTitleMm,
           2 * std::min(frame.middle_x_mm(), figure.width_mm - frame.middle_x_mm()) - 2 * kGapMm,
           Align::Middle,
           true,
           false,
           kFrameColor});
  draw_axes(figure, *x, *y, frame, drawing.shapes);
  for (std::size_t i = 0; i < figure.series.size(); ++i)
    draw_series(figure.series[i], look_of(figure, i), *x, *y, frame, drawing.shapes);
  drawing.shapes.emplace_back(Group{"legend"});
  legend(figure, title_mm, x->from_mm, &drawing.shapes);
  return drawing;
}

}  // namespace waymark::plot
