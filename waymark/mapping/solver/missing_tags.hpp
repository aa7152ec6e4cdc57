#pragma once

#include <cstddef>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/mapping/solver/changed_tags.hpp"
#include "waymark/samples/tag_detection.hpp"

/// Tags that were taken away or hidden: later images of their place do not show them.
namespace waymark {

/// A detection in an image, and whether the map uses it.
struct DetectedTag {
  TagId tag{};
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
  bool used = false;
};

/// An image with an estimated pose.
struct PlacedImage {
  std::size_t camera = 0;
  double time_s = 0;  ///< since the first image
  SE3 map_T_cam{};
  double sigma_m = 0, sigma_rad = 0;  ///< largest standard deviations of position and rotation
  std::vector<DetectedTag> detected{};
};

/// An image with this pose and the standard deviations of its covariance (as a left tangent in map).
[[nodiscard]] PlacedImage placed_image(const SE3& map_T_cam, const Matrix6& covariance);

/// A tag of the map.
struct PlacedTag {
  TagId tag{};
  SE3 map_T_tag{};
  double size_m = 0;
  double since_s = 0;  ///< time of the first image in which it is at this place; later than 0 if it was moved
  /// Tags that were probably observed together with it when an older map was made.
  std::vector<TagId> neighbours{};
};

/// The tags that should have been detected after their last detection. `images`: in order of time. `cameras`:
/// by index. Tags of a family of which no image shows a tag are skipped, because the detector may not have
/// searched for them.
///
/// A tag is expected in an image if it faces the camera, lies inside the image with a margin, and nothing is
/// known to hide it:
/// - A tag that was detected during another pass is expected near the viewpoints of these detections. Walls
///   and furniture that hide it from elsewhere have no effect.
/// - A tag of an extended map that was never detected is expected at the usual sizes and angles of
///   detections, in images that show one of its neighbours within 0.6 rad and at least 0.9 times as far away.
///   An obstacle that hides the tag would probably hide that neighbour as well.
///
/// Images count only if another tag in the map was detected. If none was for a while, they count if a single
/// tag was expected between two detections of this camera, because its absence explains that.
///
/// The unit of evidence is a pass: images that should show a tag, without longer gaps. A pass in which the
/// tag was detected is not counted against it. The shares of detections in the passes of all tags, up to the
/// last detection of each, give the distribution of the detection rate in a pass. It is the mean of beta
/// distributions, one for each pass, and of a uniform one as the prior. At least three such passes are
/// required, which may include passes of the tag itself. If one of its own passes has no detection, the
/// distribution from its own passes is used if it gives a larger probability.
///
/// A tag is missing if it was expected in ten images, over all passes since its last detection, and the
/// probability that none of them shows it is small. The limit is 0.05 divided by the number of tags that ten
/// images should show. If passes are independent and have this distribution, at most one map in twenty has a
/// false report. This is not a measured rate: passes after the last detection cannot be measured, because the
/// tag may be missing. The share of passes in which a tag is hidden is therefore underestimated.
///
/// O(images * tags in reach * (viewpoints of a tag + neighbours * detections in an image)).
[[nodiscard]] std::vector<MissingTag> missing_tags(const std::vector<CameraModel>& cameras,
                                                   const std::vector<PlacedImage>& images,
                                                   const std::vector<PlacedTag>& tags);

}  // namespace waymark

namespace waymark::internal {

/// The images of a pass in which a tag was expected, and how many of them show it.
struct PassCount {
  int expected = 0, detected = 0;
};

/// The probability that a pass with this number of expected images shows the tag in none of them, according
/// to measured passes.
[[nodiscard]] double probability_of_none(int expected, const std::vector<PassCount>& passes);

}  // namespace waymark::internal
