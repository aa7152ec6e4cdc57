#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/families/family.hpp"

namespace waymark {

/// 8x8 covariance of the corners (x0 y0 x1 y1 x2 y2 x3 y3) in px^2.
using CornerCovariance = Eigen::Matrix<double, 8, 8>;

/// Whether the corners of a detection may be used for estimates.
enum class CornerState : std::uint8_t {
  Measured,    ///< their covariance, if any, describes their error
  Unreliable,  ///< the image contradicts them, so the error may exceed the covariance by far; the id is valid
};

/// Name of a state: "measured" or "unreliable".
[[nodiscard]] constexpr const char* to_string(CornerState state) {
  return state == CornerState::Measured ? "measured" : "unreliable";
}

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
  CornerState corner_state = CornerState::Measured;
};

/// Whether estimators may use the corners. Every estimator of poses, maps and cameras checks this and leaves
/// out the other detections.
[[nodiscard]] inline bool usable_corners(const TagDetection& detection) {
  return detection.corner_state == CornerState::Measured;
}

/// The error of an estimator that needs the corners of this detection: set unless usable_corners().
[[nodiscard]] inline Status check_usable_corners(const TagDetection& detection) {
  if (usable_corners(detection)) return {};
  return fail(ErrorCode::InvalidArgument, "the corners are unreliable: the image contradicts them",
              {.key = to_string(detection.tag)},
              "Check whether the tag is flat, uncovered, sharp and surrounded by its white margin.");
}

/// Number of detections without usable corners.
[[nodiscard]] inline std::size_t count_unreliable(std::span<const TagDetection> detections) {
  return static_cast<std::size_t>(
      std::ranges::count_if(detections, [](const TagDetection& tag) { return !usable_corners(tag); }));
}

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
