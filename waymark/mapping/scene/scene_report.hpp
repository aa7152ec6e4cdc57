#pragma once

#include <string>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"

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

/// Sum of squared corner residuals, whitened by the detector's covariances, per degree of freedom. Uses views
/// with at least two tags in use. The result is about 1 if the covariances are correct and the errors of
/// different tags are independent. It is 0 if there is no such view or no covariance.
[[nodiscard]] double corner_chi2_per_dof(const SceneMap& map);

}  // namespace waymark
