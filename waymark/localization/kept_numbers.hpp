#pragma once

#include <vector>

#include <Eigen/Core>

namespace waymark {

/// Numbers that a drive does not tell from what was given stay what they were given, one after the other, the
/// least certain change first; the others move to their best beside it (backward elimination: Draper and
/// Smith, "Applied Regression Analysis", section 15.2). `change` is the step from what was given to the
/// minimum of a cost, and becomes the step to where the numbers should be; `covariance` is that of the
/// minimum. Moves what changes by `enough_sigma` of its own standard deviation, beside those that stay. True
/// for what stays. O(n^3).
[[nodiscard]] std::vector<bool> keep_given(const Eigen::MatrixXd& covariance, double enough_sigma,
                                           Eigen::VectorXd& change);

}  // namespace waymark
