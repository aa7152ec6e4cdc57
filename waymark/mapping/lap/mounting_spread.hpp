#pragma once

#include "waymark/mapping/lap/mounting_estimate.hpp"

namespace waymark::internal {

/// Replaces the standard deviations of mounting, scales and focal length by what the parts of the lap say of
/// them (stretch_covariance()), where there are enough parts. `lap` is where `estimate` was found, tied to a
/// map: tags that only the lap itself places make one of parts far from each other.
void spread_by_stretches(const LapBundle& lap, MountingEstimate& estimate);

}  // namespace waymark::internal
