#pragma once

#include <map>

#include "waymark/mapping/solver/bundle.hpp"

namespace waymark::internal {

/// Of each tag's pose (left tangent in the map), by how much it is off because its corners are not printed
/// and glued where they should be, and because a detector sees them all aside: each corner by `sigma_m` along
/// either side of the tag, the same in all pictures, which therefore do not average it away. What a fit with
/// a wrong model estimates, to first order: A^-1 B sigma^2 B^T A^-T, A the information of the tag's corners,
/// B their derivatives by the errors (Huber, "The Behavior of Maximum Likelihood Estimates under Nonstandard
/// Conditions", 5th Berkeley Symposium, 1967), with robot and camera where they stand. Tags without an
/// observation in use are left out. O(observations).
[[nodiscard]] std::map<PoseIndex, Matrix6> covariance_of_print(const Bundle& bundle, double sigma_m);

}  // namespace waymark::internal
