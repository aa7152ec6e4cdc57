#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "waymark/families/family.hpp"
#include "waymark/image/image.hpp"
#include "waymark/tags/refinement/edge_model.hpp"
#include "waymark/tags/refinement/inner_pixels.hpp"
#include "waymark/tags/refinement/tag_fit.hpp"

namespace waymark::refinement {

using InnerVector = Eigen::Matrix<double, kInnerUnknowns, 1>;
using InnerMatrix = Eigen::Matrix<double, kInnerUnknowns, kInnerUnknowns>;

/// Weighted least squares about given unknowns.
struct InnerSums {
  InnerMatrix information = InnerMatrix::Zero();  ///< for pixels with variance 1
  InnerVector gradient = InnerVector::Zero();
  double cost = 0;
  double pixels = 0;
};

/// `outwards` is the direction from an edge of the border to the middle of white: 1 outwards, -1 inwards
/// (reversed border). Residuals larger than `trusted` [grey level] are given less weight. With only
/// kUnknownsOnBorder unknowns, the pattern is rotated as illumination rotated the edges of the border; with
/// all unknowns, they determine its rotation. O(pixels).
template <int Unknowns>
[[nodiscard]] InnerSums sum_up(const InnerPixels& pixels, const InnerVector& x, double outwards,
                               double trusted, const InnerKernels& kernels = fastest_inner_kernels());
extern template InnerSums sum_up<kUnknownsOnBorder>(const InnerPixels&, const InnerVector&, double, double,
                                                    const InnerKernels&);
extern template InnerSums sum_up<kInnerUnknowns>(const InnerPixels&, const InnerVector&, double, double,
                                                 const InnerKernels&);

/// Standard deviation of the blur [px], averaged over both axes.
[[nodiscard]] double mean_blur_px(const InnerVector& x);

/// Outward displacement of the end of an edge [px] per grey level by which the mean of black and white
/// increases there. An illumination gradient along an edge appears as a rotation of the edge (tag_fit.cpp).
[[nodiscard]] double px_per_level(const InnerVector& x, double outwards);

/// Priors for the fit inside the border.
struct InnerPrior {
  InnerVector mean = InnerVector::Zero();
  InnerVector sigma = InnerVector::Ones();
  double blur_range = 0.5;  ///< maximum deviation of ln(blur) from its mean
  int iterations = 3;       ///< maximum number, if white grows little

  [[nodiscard]] InnerVector precision() const { return sigma.array().square().inverse(); }
};

/// Standard deviations of levels and blur about their priors, and of growth and slopes about 0.
struct InnerSigmas {
  double level = 0.05;    ///< for black and white, as a fraction of the step
  double slope = 0.01;    ///< as a fraction of the step
  double log_blur = 0.1;  ///< for ln(blur)
  double place_blurs = 0.03;
  double bend_blurs = 0;  ///< curvature and stretch across the tag due to an unknown lens
};
[[nodiscard]] InnerPrior inner_prior(double black, double step, double log_blur, const InnerSigmas& sigmas);

/// The prior for a print whose white is saturated: it may be far beyond the range of the image, by which its
/// blurred edges move. `step` is the visible step.
[[nodiscard]] InnerPrior saturated_prior(double black, double step, double log_blur,
                                         const InnerSigmas& sigmas);

/// An estimate of the unknowns with its covariance.
struct InnerEstimate {
  InnerVector mean;
  InnerMatrix covariance;
};

/// The fit, with the variance of a pixel [grey level^2], the last sums and the point at which they were
/// linearised.
struct InnerFit {
  InnerEstimate estimate;
  double variance = 0;
  InnerSums sums;
  InnerVector at;
};

/// One Gauss-Newton step from `x` in the first `Unknowns` unknowns; the others remain constant.
template <int Unknowns>
[[nodiscard]] InnerEstimate gauss_newton(const InnerSums& sums, double variance, const InnerPrior& prior,
                                         const InnerVector& precision, const InnerVector& x);

/// Iterates the step, from `start`. `noise_variance` is the variance of a pixel, estimated elsewhere [grey
/// level^2].
template <int Unknowns>
[[nodiscard]] InnerFit fit_inner(const InnerPixels& pixels, const InnerPrior& prior, const InnerVector& start,
                                 double noise_variance, double outwards);

extern template InnerEstimate gauss_newton<kUnknownsOnBorder>(const InnerSums&, double, const InnerPrior&,
                                                              const InnerVector&, const InnerVector&);
extern template InnerFit fit_inner<kUnknownsOnBorder>(const InnerPixels&, const InnerPrior&,
                                                      const InnerVector&, double, double);
extern template InnerFit fit_inner<kInnerUnknowns>(const InnerPixels&, const InnerPrior&, const InnerVector&,
                                                   double, double);

/// An estimate of the edges that includes model errors. It is the mean over the models with and without
/// growth of white and slopes of the levels, weighted by their probabilities (Hoeting et al., "Bayesian model
/// averaging: a tutorial", 1999).
template <int Unknowns>
[[nodiscard]] InnerEstimate averaged(const InnerFit& fit, const InnerPrior& prior);
extern template InnerEstimate averaged<kUnknownsOnBorder>(const InnerFit&, const InnerPrior&);
extern template InnerEstimate averaged<kInnerUnknowns>(const InnerFit&, const InnerPrior&);

/// Standard deviation [px] of the error of the growth model. A blur is not exactly Gaussian, especially if
/// the image was overexposed and then interpolated, scaled or compressed.
[[nodiscard]] double growth_sigma_px(const InnerVector& x);

/// Derivatives of the outward displacements (kFrom, kTo) of the four edges with respect to the unknowns [px].
using EdgesByInner = Eigen::Matrix<double, 8, kInnerUnknowns>;
[[nodiscard]] EdgesByInner edges_by_growth(const InnerVector& x, double outwards);

/// Covariance of the outward displacements of the edges [px^2] for that of the unknowns.
[[nodiscard]] Eigen::Matrix<double, 8, 8> edge_covariance(const EdgesByInner& J,
                                                          const InnerMatrix& covariance);

/// Correction of the border edges by the bits inside: outward displacements (kFrom, kTo) of the four edges
/// [px], with their covariance.
struct EdgeCorrection {
  Eigen::Matrix<double, 8, 1> outwards_px = Eigen::Matrix<double, 8, 1>::Zero();
  Eigen::Matrix<double, 8, 8> covariance_px2 = Eigen::Matrix<double, 8, 8>::Zero();
  double worst_sigmas = 0;  ///< largest distance of an edge from its position according to the bits alone,
                            ///< over its standard deviation
};

/// Corrects the edges of `estimate` for two effects that the border alone cannot separate from its position.
/// One is growth of white into black (gamma, bloom, ink), the other grey levels that increase along an edge
/// (shadow, veil, uneven illumination). Growth of white moves left and right edges in opposite directions, so
/// the edges between bits reveal it. Each of the two effects may be present or absent (Hoeting et al.,
/// "Bayesian model averaging: a tutorial", 1999). O(pixels), at most a few hundred; does not allocate.
[[nodiscard]] EdgeCorrection inner_correction(const ImageView& image, const PrintedTag& print,
                                              const TagBands& tag, const TagEstimate& estimate);

}  // namespace waymark::refinement
