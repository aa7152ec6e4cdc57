#pragma once

#include <set>
#include <string>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/mapping/solver/bundle.hpp"

namespace waymark {

/// Fills in the results of the search: covariance, reprojection error, rejected observations and unconnected
/// groups.
void report_scene(const SceneRecording& recording, SceneMap& map);

/// Computes the mean and the median reprojection error of the corners in use.
void measure_reprojection(SceneMap& map);

/// Warnings about a scene's map, one sentence each. They report given values that are inconsistent with the
/// map, with the residual in standard deviations. They report tags with many rejected observations, those
/// with a prior first. They also report tags without accepted observations, weakly connected parts (in the
/// map and excluded), and tags without a determined pose.
[[nodiscard]] std::vector<std::string> scene_warnings(const SceneMap& map);

/// Tags that are connected to the rest by so few observations that one wrong observation would move them all.
struct ThinCut {
  std::vector<PoseIndex> beyond{};  ///< tags, ascending
  std::vector<PoseIndex> by{};      ///< the tags whose observations connect them, ascending
  int observations = 0;             ///< number of observations of those tags
};

/// Finds parts of at least two tags that are connected to the rest by at most `most` observations in use,
/// sorted by size with the largest first. No part is contained in another one with the same number of
/// observations. `moves`: for each pose, whether it belongs to a single frame. `roots`: tags that are never
/// beyond a cut. Candidates are the edges of a maximum spanning tree of the tags, weighted by the number of
/// common views. Measured motion connects frames, so there are no cuts if motion is measured. O(observations
/// * tags per view), and O(tags) per cut.
[[nodiscard]] std::vector<ThinCut> thin_cuts(const Bundle& bundle, const std::vector<char>& moves,
                                             const std::set<PoseIndex>& roots, int most = 3);

/// Sum of squared corner residuals, whitened by the detector's covariances, per degree of freedom. Uses views
/// with at least two tags in use. The result is about 1 if the covariances are correct and the errors of
/// different tags are independent. It is 0 if there is no such view or no covariance.
[[nodiscard]] double corner_chi2_per_dof(const SceneMap& map);

}  // namespace waymark
