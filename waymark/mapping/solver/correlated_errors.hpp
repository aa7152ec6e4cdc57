#pragma once

#include <optional>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"

namespace waymark {

/// Number of successive images that count as one independent image. Corner errors that persist from image to
/// image (due to the lens, the print or the compression) do not average out. It is the integrated
/// autocorrelation 1 + 2 sum rho_k of the residuals in use, by tag and corner. The sum is over pairs of lags
/// while these are positive (the initial positive sequence of C. Geyer, "Practical Markov Chain Monte Carlo",
/// 1992, section 3.3), so that even a small, long-lasting part of the noise counts. The result is at least 1
/// and at most the number of images. A covariance multiplied by it is valid for images with correlated
/// errors. `frames`: image number of each corner term. O(observations * lags).
[[nodiscard]] double correlated_frames(const Bundle& bundle, const std::vector<std::size_t>& frames);

/// Parameters of stretch_covariance().
struct StretchQuestion {
  PoseIndex pose = 0;  ///< an unknown pose that is the same for the whole drive, such as a camera mounting
  std::size_t scales = 0;    ///< index into Bundle::odometry_scales
  std::size_t camera = 0;    ///< index into Bundle::cameras
  std::vector<int> stretch;  ///< stretch to which each pose of the bundle belongs; -1 if none
};

/// Covariance of parameters that are common to a whole drive, estimated from the scatter between its
/// stretches.
struct StretchCovariance {
  Matrix6 pose = Matrix6::Zero();    ///< in the left tangent
  Matrix6 scales = Matrix6::Zero();  ///< in the order of OdometryScales::vector()
  Eigen::MatrixXd intrinsics{};      ///< empty if they are fixed
  int stretches = 0;                 ///< number of stretches with measurements
};

/// Covariance H^-1 M H^-1 at a minimum, which does not assume that measurement errors are independent and
/// have the stated size (White, "Maximum Likelihood Estimation of Misspecified Models", Econometrica 50(1),
/// 1982, theorem 3.2). M is the sum of two parts:
/// - the long-run covariance of the gradients of the stretches, with lags of up to four stretches (Newey and
/// West, "A Simple, Positive Semi-definite, Heteroskedasticity and Autocorrelation Consistent Covariance
/// Matrix", Econometrica 55(3), 1987). Its mean and uncertainty are corrected as in Kiefer and Vogelsang,
/// "A New Asymptotic Theory for Heteroskedasticity-Autocorrelation Robust Tests", Econometric Theory 21(6),
/// 2005;
/// - the prior information on poses in no stretch, on scales and on intrinsics, which is used as stated.
///
/// A term belongs to the stretch of its rig or base; a prior belongs to the stretch of its last pose, and
/// odometry to the stretch of its first pose. Errors that outlast several stretches are not detected. Empty
/// if fewer than sixteen stretches contain measurements, if the pose or the scales are fixed, or if the
/// information matrix cannot be factorised.
[[nodiscard]] std::optional<StretchCovariance> stretch_covariance(const Bundle& bundle,
                                                                  const StretchQuestion& question);

}  // namespace waymark
