#pragma once
// Inside the room: lines cut off at the frame of a chart.

#include <vector>

#include "waymark/plot/drawing.hpp"

namespace waymark::plot {

/// Whether a point lies in the box, its rim included. What is not a number does not.
[[nodiscard]] inline bool inside(const Point& point, const Box& box) {
  return point.x_mm >= box.x_mm && point.x_mm <= box.right_mm() && point.y_mm >= box.y_mm &&
         point.y_mm <= box.bottom_mm();
}

/// The parts of a line through these points that lie in the box. A point that is not a number ends a part.
/// Points nearer than a fiftieth of a millimetre to the one before are left out: nobody can see them.
/// O(points). (Liang and Barsky, "A new concept and method for line clipping", ACM Transactions on Graphics
/// 3, 1984.)
[[nodiscard]] std::vector<std::vector<Point>> clipped_lines(const std::vector<Point>& points, const Box& box);

}  // namespace waymark::plot
