#pragma once

#include "waymark/mapping/lap/mounting_estimate.hpp"

namespace waymark::internal {

/// Numbers of a mounting that stand out count as not told where held-out observations do not confirm them, or
/// where they no longer stand out once the wheels have the noise that they show. Held out: the lap is cut in
/// two of equally many observations, each half estimates the mounting by itself, and what one half found must
/// lower the chi-square of the other, both ways together, against what was assumed (twofold cross-validation:
/// Stone, "Cross-Validatory Choice and Assessment of Statistical Predictions", J. Royal Statistical Society B
/// 36(2), 1974). Errors that the noise model does not have, such as those that corners of one tag share,
/// differ from half to half and do not pass. Where any number passes, those count that stand out with the
/// noise that the wheels show and that the halves confirm, also such as did not stand out before. `freed` is
/// where the estimate ended; it is searched further.
void keep_confirmed(LapBundle& freed, const SE3& assumed, int max_iterations, const BundleProgress& progress,
                    MountingEstimate& mounting);

/// Weighs the wheels by the noise that they show (fit_odometry_noise()); of a long lap, that its middle
/// shows.
void find_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress);

}  // namespace waymark::internal
