#pragma once

#include <vector>

#include "waymark/mapping/lap/lap_bundle.hpp"

/// The noise of the corners of a lap by what is left over once everything is fitted.
namespace waymark::internal {

/// Of each corner term: how many of its 8 numbers the fit has not used up, 8 - trace(J P J^T), the part of
/// the unit on the diagonal of the hat matrix (Huber and Ronchetti, "Robust Statistics", section 7.2.1). A
/// tag seen alone or from near takes more of it than the others. 8 for terms that are not in use.
[[nodiscard]] std::vector<double> freedom_left(const LapBundle& lap);

/// Corner noise over what is claimed: from the median, which outliers hardly move. 1 where too little is left
/// to tell it by.
[[nodiscard]] double noise_ratio(const std::vector<double>& chi2, const std::vector<double>& freedom);

/// correlated_frames() of the observations of a lap.
[[nodiscard]] double frames_that_count_as_one(const LapBundle& lap);

/// All corners are so many times less certain than they say.
void scale_noise(Bundle& bundle, double ratio);

}  // namespace waymark::internal
