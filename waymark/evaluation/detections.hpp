#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {

/// A tag in an image, according to the ground truth.
struct TrueTag {
  TagId tag;
  /// TL, TR, BR, BL of the printed tag, in distorted pixels with pixel centres at +1/2, as in TagDetection.
  std::array<Eigen::Vector2d, 4> corners_px{};
  double size_px =
      0;  ///< side length when viewed frontally; the mean side length if missing from the ground truth
  std::optional<double> tilt_deg = {};  ///< angle between the line of sight and the tag's normal
};

/// The tags in each image, by image name as in the ground truth.
using DetectionTruth = std::map<std::string, std::vector<TrueTag>>;

/// Parses the ground truth for detections from CSV text. The columns, in any order, are `image, id, x0, y0,
/// x1, y1, x2, y2, x3, y3` and optionally `size` or `size_px` [px], `tilt_deg`, `family` (default tag36h11);
/// others are ignored. A row in which only the image is filled in marks an image without tags. Errors contain
/// line and column.
[[nodiscard]] Result<DetectionTruth> parse_truth(std::string_view text, std::string source);

/// The image in the ground truth that corresponds to `path`. The name in the ground truth may omit leading
/// folders and the suffix ("A_010_0" or "clean/A_010_0.png" for "data/clean/A_010_0.png"). The longest
/// matching name is used; `nullopt` if no name matches.
[[nodiscard]] std::optional<std::string> find_image(const DetectionTruth& truth, std::string_view path);

/// Limits for matching a detection to a true tag. The corner distance must not exceed the larger of the two.
struct MatchOptions {
  double match_distance_px = 2.0;
  double match_distance_sides = 0.1;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.match_distance_px,
          Field{"match_distance_px",
                "Largest distance (RMS over the corners) at which a detection is matched to a true tag.", 0,
                1e6});
    visit(self.match_distance_sides, Field{"match_distance_sides",
                                           "Largest distance at which a detection is matched to a true tag, "
                                           "in sides of the tag; the larger of the two limits applies.",
                                           0, 1});
  }
};

/// A detection and the true tag it is matched to, as indices into the two lists.
struct MatchedPair {
  std::size_t detection = 0;
  std::size_t truth = 0;

  friend bool operator==(const MatchedPair&, const MatchedPair&) = default;
};

/// Classification of every detection and every true tag in one image. Each index is in exactly one list of
/// its kind.
struct Matching {
  std::vector<MatchedPair> correct;  ///< correct position, family, id and corner order; sorted by distance
  /// Detections on a true tag (in any rotation) that no other detection matches, but with a different id or
  /// rotation.
  std::vector<MatchedPair> wrong_id;
  std::vector<std::size_t> false_positives;  ///< on no true tag, or on one that is already matched
  std::vector<std::size_t> missed;           ///< true tags without a correct detection
};

/// Root mean square of the four corner distances [px] after rotating `detected` by `quarter_turns`.
[[nodiscard]] double corner_distance_px(const std::array<Eigen::Vector2d, 4>& detected,
                                        const std::array<Eigen::Vector2d, 4>& truth,
                                        std::size_t quarter_turns = 0);

/// Matches the detections in one image to its true tags. Candidates are all pairs with the same family and id
/// whose corners, in printed order, are within the limit. The nearest pair is matched first, then the nearest
/// of the remaining pairs, and so on. If distances are equal, the pair with the earlier detection, then the
/// one with the earlier true tag, is matched first. Unique ids are thus matched by id, and duplicate ids by
/// position. The remaining detections are matched in the same way, ignoring ids and allowing any rotation of
/// the corners; these have wrong ids. O(detections · truth · log).
[[nodiscard]] Matching match_detections(std::span<const TagDetection> detections,
                                        std::span<const TrueTag> truth, const MatchOptions& options = {});

/// Corner errors of the correct detections. Error = detected - true.
struct CornerScores {
  std::size_t tags = 0;  ///< number of correct detections with usable corners, four each
  double rmse_px = 0;    ///< root mean square Euclidean corner error
  double rmse_x_px = 0;  ///< along x; rmse_px^2 = rmse_x_px^2 + rmse_y_px^2
  double rmse_y_px = 0;
  double worst_px = 0;         ///< largest Euclidean corner error
  double bias_x_px = 0;        ///< mean error towards the right
  double bias_y_px = 0;        ///< mean downward error
  double bias_outward_px = 0;  ///< mean error away from the centre of the true tag
};

/// Consistency of the reported covariances, measured as the mean normalised squared error e' C^-1 e
/// (Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4).
/// It equals its degrees of freedom if the covariances are consistent and is larger if they are too small.
struct CornerConsistency {
  std::size_t tags = 0;        ///< number of correct detections with a positive definite covariance
  double mean_nes_corner = 0;  ///< 2 degrees of freedom, so 2 is expected
  double mean_nes_tag = 0;     ///< 8 degrees of freedom, so 8 is expected
};

/// Counts and corner errors for the true tags in one class (by size, by tilt, or all).
struct ClassScores {
  double low = 0;  ///< the class is [low, high)
  double high = 0;
  std::size_t truth = 0;                     ///< number of true tags
  std::size_t found = 0;                     ///< number of true tags that were detected correctly
  std::optional<CornerScores> corners = {};  ///< `nullopt` if no tag was found

  /// found / truth; `nullopt` if there are no true tags.
  [[nodiscard]] std::optional<double> recall() const;
};

/// Edges of the classes, ascending. Class i is [edges[i], edges[i+1]), and the last one includes its upper
/// edge. Values beyond the edges belong to no class.
struct ClassEdges {
  std::vector<double> size_px = {0, 11, 13, 15, 18, 22, 28, 40, 70, 140, 1e6};
  std::vector<double> tilt_deg = {0, 10, 25, 40, 55, 65, 72, 90};
};

/// Fails unless both lists are ascending, finite and contain at least two edges.
[[nodiscard]] Status check_edges(const ClassEdges& edges);

/// Detections and ground truth for one image.
struct ImageDetections {
  std::vector<TagDetection> detections;
  std::vector<TrueTag> truth;
};

/// Detection quality over a set of images.
struct DetectionScores {
  std::size_t images = 0;
  std::size_t truth = 0;       ///< number of true tags
  std::size_t detections = 0;  ///< number of reported tags = correct + wrong_ids + false_positives
  std::size_t correct = 0;
  std::size_t unreliable = 0;  ///< correct detections with unreliable corners; not in the corner errors
  std::size_t wrong_ids = 0;
  std::size_t false_positives = 0;
  std::optional<CornerScores> corners = {};           ///< `nullopt` if no tag was found
  std::optional<CornerConsistency> consistency = {};  ///< `nullopt` if no covariance was reported
  std::size_t unusable_covariances = 0;  ///< number of reported covariances that are not positive definite
  std::vector<ClassScores> by_size;
  std::vector<ClassScores> by_tilt;  ///< empty if no true tag has a tilt
  std::vector<std::vector<ClassScores>>
      by_size_and_tilt;  ///< [size][tilt], with low and high in degrees; empty if by_tilt is empty

  [[nodiscard]] std::optional<double> recall() const;
};

/// Scores a set of images; the order of the images does not matter, except for rounding. Requires
/// check_edges(edges).
[[nodiscard]] DetectionScores score_detections(std::span<const ImageDetections> images,
                                               const MatchOptions& options = {},
                                               const ClassEdges& edges = {});

}  // namespace waymark
