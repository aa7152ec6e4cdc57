#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {

/// A tag that is known to be in an image, and where.
struct TrueTag {
  TagId tag;
  /// TL, TR, BR, BL of the printed tag, in distorted pixels, centres at +1/2, as in TagDetection.
  std::array<Eigen::Vector2d, 4> corners_px{};
  double size_px = 0;  ///< side it would have seen face to face; the mean side where the truth does not say
  std::optional<double> tilt_deg = {};  ///< angle between line of sight and the tag's normal
};

/// The tags of each image, by the name the truth gives the image.
using DetectionTruth = std::map<std::string, std::vector<TrueTag>>;

/// Reads the truth of detections from CSV text. Columns, in any order: `image, id, x0, y0, x1, y1, x2, y2,
/// x3, y3`, and, where known, `size` or `size_px` [px], `tilt_deg`, `family` (tag36h11 where there is none);
/// others are ignored. A row with an image and otherwise empty cells says that the image holds no tag. Fails
/// with line and column.
[[nodiscard]] Result<DetectionTruth> parse_truth(std::string_view text, std::string source);

/// Which of the truth's images `path` is: the truth may leave out leading folders and the suffix ("A_010_0"
/// or "clean/A_010_0.png" for "data/clean/A_010_0.png"). The longest name wins; nothing when none fits.
[[nodiscard]] std::optional<std::string> find_image(const DetectionTruth& truth, std::string_view path);

}  // namespace waymark
