#pragma once

#include <Eigen/Core>

#include "waymark/tags/inner_bits.hpp"
#include "waymark/tags/inner_model.hpp"

namespace waymark::refinement {

/// What is assumed before looking inside the border.
struct InnerPrior {
  InnerVector mean = InnerVector::Zero();
  InnerVector sigma = InnerVector::Ones();

  [[nodiscard]] InnerVector precision() const { return sigma.array().square().inverse(); }
};

/// How far levels and blur may lie from what is known of them, growth and slopes from 0. Standard deviations.
struct InnerDoubts {
  double level = 0.05;    ///< of black and white, share of the step
  double slope = 0.01;    ///< share of the step
  double log_blur = 0.1;  ///< of ln(blur)
  double place_blurs = 0.03;
  double bend_blurs = 0;  ///< what a lens that is not known bends and stretches across the tag
};
[[nodiscard]] InnerPrior inner_prior(double black, double step, double log_blur, const InnerDoubts& doubts);

/// Estimate of the unknowns with its covariance.
struct InnerBelief {
  InnerVector mean;
  InnerMatrix covariance;
};

/// With the variance of a pixel [grey level^2], and the last sums and where they were taken.
struct InnerFit {
  InnerBelief belief;
  double variance = 0;
  InnerSums sums;
  InnerVector at;
};

/// One step of Gauss-Newton from `x`, on the first `Unknowns`; the others stay where they are.
template <int Unknowns>
[[nodiscard]] InnerBelief gauss_newton(const InnerSums& sums, double variance, const InnerPrior& prior,
                                       const InnerVector& precision, const InnerVector& x);

/// Iterates it. `noise_variance`: of a pixel as it was found elsewhere [grey level^2].
template <int Unknowns>
[[nodiscard]] InnerFit fit_inner(const InnerPixels& pixels, const InnerPrior& prior, double noise_variance,
                                 double outwards);

extern template InnerBelief gauss_newton<kUnknownsOnBorder>(const InnerSums&, double, const InnerPrior&,
                                                            const InnerVector&, const InnerVector&);
extern template InnerFit fit_inner<kUnknownsOnBorder>(const InnerPixels&, const InnerPrior&, double, double);
extern template InnerFit fit_inner<kInnerUnknowns>(const InnerPixels&, const InnerPrior&, double, double);

/// What a fit says of edges, with what its model leaves out: mean of what is believed with and without growth
/// of white, with and without slopes of the levels, each by how likely it is (Hoeting et al., "Bayesian model
/// averaging: a tutorial", 1999).
[[nodiscard]] InnerBelief averaged(const InnerFit& fit, const InnerPrior& prior);

/// What is left out of the model of a growth: a blur is not quite Gaussian, least of all where the picture
/// was overexposed and then interpolated, scaled or compressed [px].
[[nodiscard]] double growth_doubt_px(const InnerVector& x);

/// How the growth moves (kFrom, kTo) of the four edges outwards [px].
using EdgesByInner = Eigen::Matrix<double, 8, kInnerUnknowns>;
[[nodiscard]] EdgesByInner edges_by_growth(const InnerVector& x, double outwards);

}  // namespace waymark::refinement
