#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Dense>

#include "waymark/base/random.hpp"
#include "waymark/families/family.hpp"
#include "waymark/image/image.hpp"

/// Tags drawn into images with exactly known corners, for tests of detectors.
namespace waymark::testing {

using TagCorners = std::array<Eigen::Vector2d, 4>;

/// A square of `side_px` around `center_px`, rotated clockwise in the image by `angle_rad`: TL, TR, BR, BL.
inline TagCorners square_corners(const Eigen::Vector2d& center_px, double side_px, double angle_rad) {
  TagCorners corners;
  const Eigen::Rotation2Dd turn(angle_rad);
  const std::array<Eigen::Vector2d, 4> unit = {Eigen::Vector2d(-1, -1), {1, -1}, {1, 1}, {-1, 1}};
  for (std::size_t i = 0; i < 4; ++i) corners.at(i) = center_px + turn * (unit.at(i) * side_px / 2);
  return corners;
}

/// 3x3 homography from the square [0, side]^2 (y down) to the quad.
inline Eigen::Matrix3d homography_of_square(double side, const TagCorners& corners_px) {
  Eigen::Matrix<double, 8, 8> a;
  Eigen::Matrix<double, 8, 1> b;
  const std::array<Eigen::Vector2d, 4> square = {Eigen::Vector2d(0, 0), {side, 0}, {side, side}, {0, side}};
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = square.at(i).x();
    const double y = square.at(i).y();
    const double u = corners_px.at(i).x();
    const double v = corners_px.at(i).y();
    const auto row = static_cast<Eigen::Index>(2 * i);
    a.row(row) << x, y, 1, 0, 0, 0, -u * x, -u * y;
    a.row(row + 1) << 0, 0, 0, x, y, 1, -v * x, -v * y;
    b(row) = u;
    b(row + 1) = v;
  }
  const Eigen::Matrix<double, 8, 1> h = a.fullPivLu().solve(b);
  Eigen::Matrix3d out;
  out << h(0), h(1), h(2), h(3), h(4), h(5), h(6), h(7), 1;
  return out;
}

/// Draws the cells of a tag (from bitmap()) so that the border square has these corners; each pixel is the
/// mean of 8 x 8 points in it. Cells outside the tag leave the image unchanged.
inline void paint_cells(Image& image, const Family& family, const std::vector<std::uint8_t>& cells,
                        const TagCorners& corners_px, double black = 30, double white = 220) {
  constexpr int kSamples = 8;
  const int margin = (family.total_width - family.width_at_border) / 2;
  const Eigen::Matrix3d px_H_cell = homography_of_square(family.width_at_border, corners_px);
  const Eigen::Matrix3d cell_H_px = px_H_cell.inverse();
  Eigen::Array2d low(1e9, 1e9);
  Eigen::Array2d high(-1e9, -1e9);
  const double outer = family.width_at_border + margin;
  for (const double x : {-1.0 * margin, outer}) {
    for (const double y : {-1.0 * margin, outer}) {
      const Eigen::Vector2d px = (px_H_cell * Eigen::Vector3d(x, y, 1)).hnormalized();
      low = low.min(px.array());
      high = high.max(px.array());
    }
  }
  const auto at_cell = [&](const Eigen::Vector2d& p, double background) {
    const int x = static_cast<int>(std::floor(p.x())) + margin;
    const int y = static_cast<int>(std::floor(p.y())) + margin;
    if (x < 0 || y < 0 || x >= family.total_width || y >= family.total_width) return background;
    const auto index = static_cast<std::size_t>(y) * static_cast<std::size_t>(family.total_width);
    const std::uint8_t value = cells.at(index + static_cast<std::size_t>(x));
    return value == 128 ? background : (value == 0 ? black : white);
  };
  for (int y = std::max(0, static_cast<int>(low.y())); y < std::min<double>(image.height(), high.y()); ++y) {
    for (int x = std::max(0, static_cast<int>(low.x())); x < std::min<double>(image.width(), high.x()); ++x) {
      double sum = 0;
      for (int s = 0; s < kSamples * kSamples; ++s) {
        const double px = x + (s % kSamples + 0.5) / kSamples;
        const double py =
            y + (s / kSamples + 0.5) / kSamples;  // NOLINT(bugprone-integer-division): a grid of points
        sum += at_cell((cell_H_px * Eigen::Vector3d(px, py, 1)).hnormalized(), image.row(y)[x]);
      }
      image.row(y)[x] = static_cast<std::uint8_t>(std::lround(sum / (kSamples * kSamples)));
    }
  }
}

inline void paint_tag(Image& image, const TagId& tag, const TagCorners& corners_px, double black = 30,
                      double white = 220) {
  paint_cells(image, family(tag.family), bitmap(tag), corners_px, black, white);
}

/// Adds normal noise to every pixel.
inline void add_noise(Image& image, double sigma, Random& random) {
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double value = image.row(y)[x] + random.normal(0, sigma);
      image.row(y)[x] = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
    }
  }
}

/// The largest distance between corresponding corners.
inline double max_corner_error_px(const TagCorners& a, const TagCorners& b) {
  double worst = 0;
  for (std::size_t i = 0; i < 4; ++i) worst = std::max(worst, (a.at(i) - b.at(i)).norm());
  return worst;
}

}  // namespace waymark::testing
