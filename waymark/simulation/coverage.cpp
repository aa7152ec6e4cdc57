#include "waymark/simulation/coverage.hpp"

#include <algorithm>
#include <cmath>

namespace waymark::photo {

void Coverage::reset(int width, int height) {
  width_ = width;
  height_ = height;
  cells_.assign(static_cast<std::size_t>(width + 1) * static_cast<std::size_t>(height), Cell{});
}

void Coverage::add(std::span<const Eigen::Vector2d> corners, double value) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    add_edge(corners[i], corners[i + 1 < corners.size() ? i + 1 : 0], value);
  }
}

void Coverage::add_edge(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double value) {
  const bool downwards =
      from.y() < to.y();  // a right side of a clockwise polygon: takes away what lies right of it
  const Eigen::Vector2d& top = downwards ? from : to;
  const Eigen::Vector2d& bottom = downwards ? to : from;
  const double y_begin = std::max(top.y(), 0.0);
  const double y_end = std::min(bottom.y(), static_cast<double>(height_));
  if (!(y_begin < y_end)) return;
  const double slope = (bottom.x() - top.x()) / (bottom.y() - top.y());
  const double sign = downwards ? -1.0 : 1.0;
  for (int y = static_cast<int>(y_begin); y < height_ && y < y_end; ++y) {
    const double begin = std::max(y_begin, static_cast<double>(y));
    const double end = std::min(y_end, y + 1.0);
    add_in_row(y, top.x() + (begin - top.y()) * slope, top.x() + (end - top.y()) * slope,
               sign * (end - begin), value);
  }
}

/// A piece of an edge inside row y: from x_from to x_to while it descends by |height| (the sign is that of
/// the edge).
void Coverage::add_in_row(int y, double x_from, double x_to, double height, double value) {
  const double right_end = width_;
  const double left = std::clamp(std::min(x_from, x_to), 0.0, right_end);
  const double right = std::clamp(std::max(x_from, x_to), 0.0, right_end);
  if (std::min(x_from, x_to) >= right_end) return;
  const double length = std::abs(x_to - x_from);
  if (length < 1e-12) {  // upright
    const int x = static_cast<int>(left);
    const double beside = left - x;
    add_area(y, x, height * (1 - beside), value);
    add_area(y, x + 1, height * beside, value);
    return;
  }
  const double per_x = height / length;
  const double outside_left = std::max(0.0, -std::min(x_from, x_to)) - std::max(0.0, -std::max(x_from, x_to));
  add_area(y, 0, per_x * outside_left, value);  // covers its rows from the first cell on
  for (int x = static_cast<int>(left); x < width_ && x < right; ++x) {
    const double begin = std::max(left, static_cast<double>(x));
    const double end = std::min(right, x + 1.0);
    const double piece = per_x * (end - begin);
    const double beside = (begin + end) / 2 - x;
    add_area(y, x, piece * (1 - beside), value);
    add_area(y, x + 1, piece * beside, value);
  }
}

void Coverage::add_area(int y, int x, double area, double value) {
  if (x > width_) return;
  Cell& cell = cells_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) +
                      static_cast<std::size_t>(x)];
  cell.covered += area;
  cell.value += area * value;
}

std::span<const Coverage::Cell> Coverage::finish_row(int y) {
  const auto width = static_cast<std::size_t>(width_);
  const std::span<Cell> row(cells_.data() + static_cast<std::size_t>(y) * (width + 1), width);
  Cell sum;
  for (Cell& cell : row) {
    sum.covered += cell.covered;
    sum.value += cell.value;
    cell = sum;
  }
  return row;
}

}  // namespace waymark::photo
