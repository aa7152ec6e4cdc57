#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "waymark/samples/calibration_board.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// A part of a calibration target seen in one image: either a tag with its four corners, or one corner of a
/// board.
struct TargetMark {
  std::int64_t key = 0;                            ///< identifies the same mark in every image
  std::vector<Eigen::Vector3d> target_points_m{};  ///< one to four points in the target's frame
  /// Their image positions in the same order; distorted, with pixel centres at +1/2.
  std::vector<Eigen::Vector2d> seen_px{};
  Eigen::MatrixXd covariance_px2{};  ///< covariance of seen_px (x, y, x, y, …); empty if unknown
};

/// The marks of one image.
using TargetMarks = std::vector<TargetMark>;

/// The tags in an image that belong to the target and have usable corners.
[[nodiscard]] TargetMarks target_marks(std::span<const TagDetection> detections, const TagMap& target);
/// The corners of a board in an image; `places_m` is the result of board_corners().
[[nodiscard]] TargetMarks target_marks(std::span<const BoardCorner> corners,
                                       std::span<const Eigen::Vector2d> places_m);

/// Mean distance between the positions of points common to two images [px]; infinite if they share less than
/// half of the marks in the image with fewer marks. O(marks log marks).
[[nodiscard]] double apart_px(const TargetMarks& a, const TargetMarks& b);

}  // namespace waymark
