#pragma once

#include <array>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "waymark/tags/pattern_pixels.hpp"

namespace waymark::refinement {

using TagVector = Eigen::Matrix<double, kTagParameters, 1>;
using TagMatrix = Eigen::Matrix<double, kTagParameters, kTagParameters>;
using Matrix8 = Eigen::Matrix<double, 8, 8>;

/// Standard deviations of what is assumed before looking.
struct TagPriors {
  double black_slope = 0.06;  ///< share of the step, from the middle to the border
  double step_slope = 0.06;
  double growth = 1.0;
  double blur_px = 0.65;
  double log_blur = 0.5;
  double stretch = 0.3;
  double halo = 0.3;
  double rim = 1.0;
  std::array<double, 4> lens{};
};

/// How the picture of a tag is taken to be, and what its pixels say there.
struct PatternFit {
  Pattern pattern;
  TagPixels pixels;
  TagPriors priors;
  TagVector x = TagVector::Zero();
  Eigen::Vector2d radial{1, 0};  ///< direction of LensBends
  double noise_variance = 25;    ///< [grey level^2]
  PatternSums sums;              ///< of the last measure()
  std::array<BlockSums, TagPixels::kMostBlocks> blocks;
  TagMatrix information;  ///< of the last measure() with it, in units of the noise then, with the priors
};

[[nodiscard]] Eigen::Matrix3d homography_of(const TagVector& x);

/// How a lens moves a place, see PatternPoint::lens: one column for each of kLens.
[[nodiscard]] Eigen::Matrix<double, 2, 4> lens_bends(const PatternFit& fit, const Eigen::Vector2d& place);

/// The corner of the tag at t = (±1, ±1) in x and y, as the lens shows it.
[[nodiscard]] Eigen::Vector2d place_of_corner(const PatternFit& fit, int corner);

/// How the corners (x0 y0 ... x3 y3), in x and y, move with the parameters.
[[nodiscard]] Eigen::Matrix<double, 8, kTagParameters> corners_by_parameters(const PatternFit& fit);

/// Compares the pixels with the model, each cluster with its weight.
void measure(bool with_information, PatternFit& fit, SumPattern sum_pattern = quickest_sum_pattern());

/// What the residuals of the last measure() show [grey level^2].
[[nodiscard]] double residual_variance(const PatternFit& fit);

/// The normal matrix, with the priors, of the last measure() with information into `fit.information`, in
/// units of the noise that its residuals show.
void set_information(PatternFit& fit);

/// The right side of the normal equations of the last measure(), with the priors, in units of the noise.
[[nodiscard]] TagVector gradient_of(const PatternFit& fit);

}  // namespace waymark::refinement
