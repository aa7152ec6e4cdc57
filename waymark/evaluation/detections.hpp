#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/evaluation/matching.hpp"

namespace waymark {

/// How far the corners of correct detections lie from the truth. Error = detected - true.
struct CornerScores {
  std::size_t tags = 0;  ///< correct detections behind the figures, four corners each
  double rmse_px = 0;    ///< root mean square of the Euclidean corner error
  double rmse_x_px = 0;  ///< the same along x; rmse_px^2 = rmse_x_px^2 + rmse_y_px^2
  double rmse_y_px = 0;
  double worst_px = 0;         ///< largest Euclidean corner error
  double bias_x_px = 0;        ///< mean error to the right
  double bias_y_px = 0;        ///< mean error downwards
  double bias_outward_px = 0;  ///< mean error away from the centre of the true tag
};

/// Whether the reported covariances are consistent: mean of the normalised error squared e' C^-1 e, which is
/// the number of its degrees of freedom when they are, more when they promise too much (Bar-Shalom, Li and
/// Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4).
struct CornerConsistency {
  std::size_t tags = 0;        ///< correct detections with a positive definite covariance
  double mean_nes_corner = 0;  ///< 2 degrees of freedom: expected 2
  double mean_nes_tag = 0;     ///< 8 degrees of freedom: expected 8
};

/// Counts and corner errors of the true tags in one class (a size, a tilt, or all).
struct ClassScores {
  double low = 0;  ///< the class is [low, high)
  double high = 0;
  std::size_t truth = 0;                     ///< true tags
  std::size_t found = 0;                     ///< of which correctly detected
  std::optional<CornerScores> corners = {};  ///< nothing when none was found

  /// found / truth; nothing without true tags.
  [[nodiscard]] std::optional<double> recall() const;
};

/// Edges of the classes, ascending; class i is [edges[i], edges[i+1]), the last one includes its upper edge.
/// What lies outside is in no class.
struct ClassEdges {
  std::vector<double> size_px = {0, 11, 13, 15, 18, 22, 28, 40, 70, 140, 1e6};
  std::vector<double> tilt_deg = {0, 10, 25, 40, 55, 65, 72, 90};
};

/// Fails unless both lists are ascending, finite and hold two edges or more.
[[nodiscard]] Status check_edges(const ClassEdges& edges);

/// The answers and the truth of one image.
struct ImageDetections {
  std::vector<TagDetection> detections;
  std::vector<TrueTag> truth;
};

/// How well tags were detected over a set of images.
struct DetectionScores {
  std::size_t images = 0;
  std::size_t truth = 0;       ///< true tags
  std::size_t detections = 0;  ///< reported tags = correct + wrong_ids + false_positives
  std::size_t correct = 0;
  std::size_t wrong_ids = 0;
  std::size_t false_positives = 0;
  std::optional<CornerScores> corners = {};           ///< nothing when nothing was found
  std::optional<CornerConsistency> consistency = {};  ///< nothing when no covariance was reported
  std::size_t unusable_covariances = 0;               ///< reported, but not positive definite
  std::vector<ClassScores> by_size;
  std::vector<ClassScores> by_tilt;  ///< empty when no true tag has a tilt
  std::vector<std::vector<ClassScores>>
      by_size_and_tilt;  ///< [size][tilt], each low..high in degrees; empty like by_tilt

  [[nodiscard]] std::optional<double> recall() const;
};

/// Scores a set of images; the order of the images does not matter but for rounding. Requires
/// check_edges(edges).
[[nodiscard]] DetectionScores score_detections(std::span<const ImageDetections> images,
                                               const MatchOptions& options = {},
                                               const ClassEdges& edges = {});

}  // namespace waymark
