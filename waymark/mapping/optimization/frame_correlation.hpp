#pragma once

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// How many successive pictures of a video count as one: errors of corners that last from picture to picture
/// (of the lens, the print, the compression) do not average out. The integrated autocorrelation 1 + 2 sum
/// rho_k of the residuals in use, by tag and corner, summed over pairs of lags as long as those are positive
/// (the initial positive sequence of C. Geyer, "Practical Markov Chain Monte Carlo", 1992, section 3.3: a
/// small part of the noise that lasts long counts too), at least 1 and at most the number of pictures.
/// Covariances times this factor are those of as many independent pictures. O(observations * lags).
[[nodiscard]] double correlated_frames(const SceneMap& map);

}  // namespace waymark
