#pragma once

#include <array>

#include <Eigen/Core>

#include "waymark/tags/pattern_pixels.hpp"

namespace waymark::refinement {

/// Parameters of the picture of one tag.
enum TagParameter : int {
  kHomography = 0,  ///< 8: the homography from the border square to x, y, its last entry 1
  kBlackPlane = 8,  ///< 3: [grey level] at the middle, change to the border along u and along v
  kStepPlane = 11,  ///< 3: the same of white less black
  kTagGrowth = 14,  ///< ln of (1 + growth)
  kLogBlur = 15,    ///< ln of the blur's standard deviation [px]
  kStretch = 16,    ///< 2: blur covariance is blur^2 [1 + e1, e2; e2, 1 - e1]
  kRim = 18,        ///< 4: beyond the margin at each side
  kLens = 22,       ///< curvature of straight lines, in units of what is expected
  kTagParameters = 23
};

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
  double rim = 1.0;
};

/// Least squares around one parameter vector.
struct TagEquations {
  TagMatrix information = TagMatrix::Zero();
  TagVector gradient = TagVector::Zero();
  double cost = 0;
  double pixels = 0;
};

/// How a tag looks at one parameter vector: what its pixels say, patch by patch.
struct TagFitState {
  TagVector x = TagVector::Zero();
  double noise_variance = 25;
  std::array<TagVector, TagPixels::kMostPatches> patch_gradient;  ///< of the last equations_of(), weighted
  std::array<PatchSums, TagPixels::kMostPatches> sums;            ///< of the last measure_patches()
};

[[nodiscard]] Eigen::Matrix3d homography_of(const TagVector& x);

/// J_corners_homography: how the corners (x0 y0 ... x3 y3), in units of x and y, move with kHomography.
[[nodiscard]] Matrix8 corners_by_homography(const TagVector& x);

/// Compares the pixels with the model, patch by patch, into `state.sums`.
void measure_patches(const Pattern& pattern, const TagPixels& pixels, TagFitState& state,
                     SumPatch sum_patch = quickest_sum_patch());

/// What the patches say together, each with its weight, about the parameters of the tag; of the last
/// measure_patches() at the same place.
/// `with_information`: false leaves that at zero and takes a tenth of the time.
[[nodiscard]] TagEquations equations_of(const Pattern& pattern, const TagPixels& pixels,
                                        bool with_information, TagFitState& state);

/// The normal equations with the priors, in units of the noise.
void add_priors(const TagPriors& priors, const TagVector& x, TagMatrix& information, TagVector& gradient);

}  // namespace waymark::refinement
