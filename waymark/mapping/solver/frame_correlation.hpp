#pragma once

#include <vector>

#include "waymark/mapping/solver/bundle.hpp"

namespace waymark {

/// How many successive pictures count as one: errors of corners that last from picture to picture
/// (of the lens, the print, the compression) do not average out. The integrated autocorrelation 1 + 2 sum
/// rho_k of the residuals in use, by tag and corner, summed over pairs of lags as long as those are positive
/// (the initial positive sequence of C. Geyer, "Practical Markov Chain Monte Carlo", 1992, section 3.3: a
/// small part of the noise that lasts long counts too), at least 1 and at most the number of pictures.
/// Covariances times this factor are those of as many independent pictures. `frames`: of each corner term,
/// the number of its picture. O(observations * lags).
[[nodiscard]] double correlated_frames(const Bundle& bundle, const std::vector<std::size_t>& frames);

}  // namespace waymark
