#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "waymark/samples/calibration_board.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// A part of a calibration target in one image: a tag with its four corners, or one corner of a board.
struct TargetMark {
  std::int64_t key = 0;                            ///< identifies the mark in every image
  std::vector<Eigen::Vector3d> target_points_m{};  ///< 1 to 4, in the target's frame
  std::vector<Eigen::Vector2d> seen_px{};          ///< the same number; distorted, pixel centres at +1/2
  Eigen::MatrixXd covariance_px2{};                ///< of seen_px (x, y, x, y, …); empty: unknown
};

/// The marks of one image.
using TargetPicture = std::vector<TargetMark>;

/// The tags of an image that belong to the target.
[[nodiscard]] TargetPicture target_marks(std::span<const TagDetection> detections, const TagMap& target);
/// The corners of a board in an image; `places_m` is the result of board_corners().
[[nodiscard]] TargetPicture target_marks(std::span<const BoardCorner> corners,
                                         std::span<const Eigen::Vector2d> places_m);

/// Mean distance of the points common to two images [px]; infinite if they share less than half of the marks
/// of the one with fewer. O(marks log marks).
[[nodiscard]] double apart_px(const TargetPicture& a, const TargetPicture& b);

}  // namespace waymark
