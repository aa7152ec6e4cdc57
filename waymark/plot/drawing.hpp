#pragma once

#include <string>
#include <variant>
#include <vector>

namespace waymark::plot {

/// A point on the page, in millimetres from its top left corner; x points right and y down.
struct Point {
  double x_mm = 0;
  double y_mm = 0;

  friend bool operator==(const Point&, const Point&) = default;
};

/// An upright rectangle on the page.
struct Box {
  double x_mm = 0;  ///< left
  double y_mm = 0;  ///< top
  double width_mm = 0;
  double height_mm = 0;

  [[nodiscard]] double right_mm() const { return x_mm + width_mm; }
  [[nodiscard]] double bottom_mm() const { return y_mm + height_mm; }
  [[nodiscard]] double middle_x_mm() const { return x_mm + width_mm / 2; }
  [[nodiscard]] double middle_y_mm() const { return y_mm + height_mm / 2; }
};

/// An sRGB colour; each component is from 0 to 1.
struct Color {
  double red = 0;
  double green = 0;
  double blue = 0;

  friend bool operator==(const Color&, const Color&) = default;
};
inline constexpr Color kBlack{0, 0, 0};
inline constexpr Color kWhite{1, 1, 1};

/// A filled area bounded by closed loops, using the even-odd rule.
struct Fill {
  std::vector<std::vector<Point>> loops;
  Color color;
};

/// A line through a sequence of points.
struct Stroke {
  std::vector<Point> points;
  double width_mm = 0.2;
  Color color;
  std::vector<double> dash_mm;  ///< lengths of dash, gap, dash, …; solid if empty
};

enum class Align { Left, Middle, Right };

/// One line of text. If it is longer than `room_mm`, it is shrunk to that length, so it never overflows.
struct Text {
  std::string words;     ///< UTF-8
  Point baseline;        ///< point on the baseline at the left end, the middle or the right end
  double height_mm = 3;  ///< font size (em), before shrinking
  double room_mm = 1e9;  ///< maximum length
  Align align = Align::Left;
  bool bold = false;
  bool upwards = false;  ///< rotated by 90 degrees, to be read from bottom to top
  Color color = {};
};

/// A named part of the page, written as an SVG group with this id so that it can be found later.
struct Group {
  std::string name;
};

using Shape = std::variant<Fill, Stroke, Text, Group>;

/// A page at true size, white by default. Later shapes cover earlier ones.
struct Drawing {
  double width_mm = 0;
  double height_mm = 0;
  std::string title;
  std::vector<Shape> shapes;
};

/// A filled rectangle.
[[nodiscard]] inline Fill filled(const Box& box, Color color = kBlack) {
  return {{{{box.x_mm, box.y_mm},
            {box.right_mm(), box.y_mm},
            {box.right_mm(), box.bottom_mm()},
            {box.x_mm, box.bottom_mm()}}},
          color};
}

}  // namespace waymark::plot
