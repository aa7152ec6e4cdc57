#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// How many successive pictures of a video count as one: errors of corners that last from picture to picture
/// (of the lens, the print, the compression) do not average out. The integrated autocorrelation 1 + 2 sum
/// rho_k of the residuals in use, by tag and corner, summed until rho_k falls below 0.05 (A. Sokal, "Monte
/// Carlo Methods in Statistical Mechanics: Foundations and New Algorithms", 1997, section 3), at least 1 and
/// at most the number of pictures. Covariances times this factor are those of as many independent pictures.
/// O(observations * lags).
[[nodiscard]] double correlated_frames(const SceneMap& map);

}  // namespace waymark
