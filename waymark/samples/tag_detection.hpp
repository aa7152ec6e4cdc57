#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "waymark/families/family.hpp"

namespace waymark {

/// 8x8 covariance of the corners (x0 y0 x1 y1 x2 y2 x3 y3) in px^2.
using CornerCovariance = Eigen::Matrix<double, 8, 8>;

/// One tag detected in one image.
struct TagDetection {
  TagId tag;
  int hamming = 0;             ///< number of corrected bits
  double decision_margin = 0;  ///< mean distance of data bits from the black/white threshold [grey levels]
  /// TL, TR, BR, BL of the printed tag (where the black border meets the white border), in distorted pixels
  /// with centres at +1/2.
  std::array<Eigen::Vector2d, 4> corners_px{};
  /// Covariance of corners_px; empty if the detector does not estimate it.
  std::optional<CornerCovariance> corner_covariance_px2{};
};

/// The intersection of the quad's diagonals [px], which is the image of the tag's centre under any
/// perspective, unlike the mean of the corners. Returns the mean if the diagonals are parallel.
[[nodiscard]] inline Eigen::Vector2d center_px(const std::array<Eigen::Vector2d, 4>& corners_px) {
  const Eigen::Vector2d a = corners_px[2] - corners_px[0];
  const Eigen::Vector2d b = corners_px[3] - corners_px[1];
  const Eigen::Vector2d from = corners_px[1] - corners_px[0];
  const double cross = a.x() * b.y() - a.y() * b.x();
  constexpr double kParallel = 1e-9;
  if (std::abs(cross) <= kParallel * a.norm() * b.norm()) {
    return (corners_px[0] + corners_px[1] + corners_px[2] + corners_px[3]) / 4;
  }
  return corners_px[0] + a * ((from.x() * b.y() - from.y() * b.x()) / cross);
}

/// Mean length of the four sides [px].
[[nodiscard]] inline double mean_side_px(const std::array<Eigen::Vector2d, 4>& corners_px) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum += (corners_px[i] - corners_px[(i + 1) % 4]).norm();
  return sum / 4;
}

}  // namespace waymark
