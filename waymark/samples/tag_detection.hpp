#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "waymark/families/family.hpp"

namespace waymark {

/// 8x8 covariance of the corners (x0 y0 x1 y1 x2 y2 x3 y3) in px^2.
using CornerCovariance = Eigen::Matrix<double, 8, 8>;

/// One tag seen in one image.
struct TagDetection {
  TagId tag;
  int hamming = 0;             ///< bits corrected
  double decision_margin = 0;  ///< [grey level] mean distance of the data bits from the black/white threshold
  /// TL, TR, BR, BL of the printed tag (where black border meets white border), in distorted pixels, centres
  /// at +1/2.
  std::array<Eigen::Vector2d, 4> corners_px{};
  /// Covariance of corners_px; nothing when the detector does not know it.
  std::optional<CornerCovariance> corner_covariance_px2{};
};

}  // namespace waymark
