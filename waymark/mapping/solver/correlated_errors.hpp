#pragma once

#include <optional>
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

/// What is asked of stretch_covariance().
struct StretchQuestion {
  PoseIndex pose = 0;        ///< an unknown pose that all of the drive shares, as a camera's mounting
  std::size_t scales = 0;    ///< index into Bundle::odometry_scales
  std::size_t camera = 0;    ///< index into Bundle::cameras
  std::vector<int> stretch;  ///< of each pose of the bundle: in which part of the drive it is; -1: in none
};

/// Covariance of numbers that a whole drive shares, by what the parts of the drive say of them.
struct StretchCovariance {
  Matrix6 pose = Matrix6::Zero();    ///< left tangent
  Matrix6 scales = Matrix6::Zero();  ///< of OdometryScales::vector()
  Eigen::MatrixXd intrinsics{};      ///< empty where they are known
  int stretches = 0;                 ///< that hold measurements
};

/// The covariance where the poses stand (a minimum), without the assumption that measurements err
/// independently and as much as they are taken for: H^-1 M H^-1 (White, "Maximum Likelihood Estimation of
/// Misspecified Models", Econometrica 50(1), 1982, theorem 3.2), M the long-run covariance of the gradients
/// of the stretches (Newey and West, "A Simple, Positive Semi-definite, Heteroskedasticity and
/// Autocorrelation Consistent Covariance Matrix", Econometrica 55(3), 1987, over four stretches; its mean and
/// its own uncertainty corrected after Kiefer and Vogelsang, "A New Asymptotic Theory for Heteroskedasticity-
/// Autocorrelation Robust Tests", Econometric Theory 21(6), 2005), and of the information of what is known of
/// poses in no stretch, of scales and of intrinsics, which counts as stated. A term belongs to the stretch of
/// its rig, base or, of a prior, last pose; odometry to that where it begins. Errors that last longer than
/// some stretches are not found. Nothing where fewer than sixteen stretches hold measurements, where pose or
/// scales are known, and where the information matrix cannot be factorised.
[[nodiscard]] std::optional<StretchCovariance> stretch_covariance(const Bundle& bundle,
                                                                  const StretchQuestion& question);

}  // namespace waymark
