#pragma once

#include "waymark/mapping/lap/lap_bundle.hpp"

namespace waymark {

/// How much noisier the odometry of a lap is than it was taken for: along, across, turning (1: as taken for).
using OdometryNoise = Eigen::Vector3d;

/// Finds the noise of the wheels from what they and the tags disagree in, and weighs them by it, adjusting
/// everything again: expectation maximisation of the variances (Dempster, Laird and Rubin, "Maximum
/// Likelihood from Incomplete Data via the EM Algorithm", J. Royal Statistical Society B 39(1), 1977).
/// Numbers that rest on many small turns, such as where the camera sits, are biased when the noise is taken
/// for larger than it is. Errors that outlast a picture (a robot that drifts sideways for a tenth of a
/// second) add up to more than the single steps show, and one that undoes itself (ticks of a counter) to
/// less: what half a second shows counts where it is more. The bundle stays where it ends.
OdometryNoise fit_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress = {});

}  // namespace waymark
