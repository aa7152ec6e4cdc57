#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "waymark/families/family.hpp"
#include "waymark/image/image.hpp"
#include "waymark/tags/refinement/edge_model.hpp"
#include "waymark/tags/refinement/tag_fit.hpp"

namespace waymark::refinement {

/// Pixels inside the border of a tag and the cells around them, kLanes side by side.
struct InnerPixels {
  static constexpr int kCorrectionPixels = 200;  ///< enough to correct edges that the border determines
  static constexpr int kPlacementPixels = 800;   ///< enough to determine them without the border
  static constexpr int kMaxBlocks = 2 * kPlacementPixels / kLanes;

  struct Block {
    Lanes value;   ///< grey level corrected for illumination
    Lanes weight;  ///< 0 or 1
    Lanes s, t;    ///< position along TL-TR and along TR-BR, -1 to 1 inside the border
    std::array<std::array<Lanes, 3>, 2>
        past_px;                       ///< distance past the three nearest lines between columns, rows
    std::array<Lanes, 2> px_per_cell;  ///< across columns, rows
    std::array<std::array<Lanes, 3>, 2> place;  ///< positions of those lines, -1 to 1
    std::array<std::array<Lanes, 4>, 4> white;  ///< rows by columns: share of white of the cells around them
  };
  std::array<Block, kMaxBlocks> block;
  int count = 0;  ///< pixels

  [[nodiscard]] std::size_t blocks() const { return static_cast<std::size_t>((count + kLanes - 1) / kLanes); }
};

/// Reads the pixels, with cells placed by the four border edges of `estimate`; for large tags `most`
/// (kCorrectionPixels or kPlacementPixels) that are evenly distributed. O(pixels).
void read_inner_pixels(const ImageView& image, const TagId& id, const TagBands& tag,
                       const TagEstimate& estimate, int most, InnerPixels& pixels);

/// Unknowns fitted to the pixels inside the border. s and t run along TL-TR and along TR-BR, -1 to 1.
enum InnerUnknown : std::uint8_t {
  kBlack,   ///< [grey level] in the middle of the tag
  kBlackS,  ///< [grey level] added at s = 1
  kBlackT,
  kWhite,  ///< [grey level] step from black to white in the middle
  kWhiteS,
  kWhiteT,
  kGrowth,  ///< of white, in blurs
  kBlurS,   ///< ln of the standard deviation [px] across columns
  kBlurT,   ///< across rows
  kShiftS,  ///< displacement of the pattern from its place within the border, in blurs
  kShiftT,
  kStretchS,  ///< displacement proportional to s, value at s = 1
  kStretchT,
  kShearS,  ///< displacement of the lines between columns proportional to t; of those between rows to s
  kShearT,
  kTaperS,  ///< of the stretch, proportional in the same way
  kTaperT,
  kSqueezeS,  ///< displacement proportional to s^2, as from lens distortion; of lines between rows to t^2
  kSqueezeT,
  kBendS,  ///< displacement of lines between columns proportional to t^2; of those between rows to s^2
  kBendT
};
constexpr int kInnerUnknowns = kBendT + 1;
constexpr int kUnknownsOnBorder = kStretchT + 1;  ///< for a pattern placed by the border
using InnerVector = Eigen::Matrix<double, kInnerUnknowns, 1>;
using InnerMatrix = Eigen::Matrix<double, kInnerUnknowns, kInnerUnknowns>;

/// Weighted least squares around given unknowns.
struct InnerSums {
  InnerMatrix information = InnerMatrix::Zero();  ///< of pixels with variance 1
  InnerVector gradient = InnerVector::Zero();
  double cost = 0;
  double pixels = 0;
};

/// `outwards`: direction from an edge of the border to the middle of white: 1 outwards, -1 inwards (reversed
/// border). Residuals larger than `trusted` [grey level] have less weight. With kUnknownsOnBorder unknowns
/// the pattern is rotated as illumination rotated the border's edges; with all, the unknowns determine its
/// rotation. O(pixels).
template <int Unknowns>
[[nodiscard]] InnerSums sum_up(const InnerPixels& pixels, const InnerVector& x, double outwards,
                               double trusted);
extern template InnerSums sum_up<kUnknownsOnBorder>(const InnerPixels&, const InnerVector&, double, double);
extern template InnerSums sum_up<kInnerUnknowns>(const InnerPixels&, const InnerVector&, double, double);

/// Standard deviation of the blur [px], mean of both axes.
[[nodiscard]] double mean_blur_px(const InnerVector& x);

/// Outward displacement of the end of an edge [px] per grey level by which the mean of black and white
/// increases there. An illumination gradient along an edge appears as a rotation of the edge (tag_fit.cpp).
[[nodiscard]] double px_per_level(const InnerVector& x, double outwards);

/// Priors of the fit inside the border.
struct InnerPrior {
  InnerVector mean = InnerVector::Zero();
  InnerVector sigma = InnerVector::Ones();

  [[nodiscard]] InnerVector precision() const { return sigma.array().square().inverse(); }
};

/// Standard deviations of levels and blur from their priors, and of growth and slopes from 0.
struct InnerSigmas {
  double level = 0.05;    ///< of black and white, fraction of the step
  double slope = 0.01;    ///< fraction of the step
  double log_blur = 0.1;  ///< of ln(blur)
  double place_blurs = 0.03;
  double bend_blurs = 0;  ///< curvature and stretch by an unknown lens across the tag
};
[[nodiscard]] InnerPrior inner_prior(double black, double step, double log_blur, const InnerSigmas& sigmas);

/// Estimate of the unknowns with its covariance.
struct InnerEstimate {
  InnerVector mean;
  InnerMatrix covariance;
};

/// With the variance of a pixel [grey level^2], and the last sums and their linearisation point.
struct InnerFit {
  InnerEstimate estimate;
  double variance = 0;
  InnerSums sums;
  InnerVector at;
};

/// One Gauss-Newton step from `x` in the first `Unknowns`; the others stay constant.
template <int Unknowns>
[[nodiscard]] InnerEstimate gauss_newton(const InnerSums& sums, double variance, const InnerPrior& prior,
                                         const InnerVector& precision, const InnerVector& x);

/// Iterates the step. `noise_variance`: variance of a pixel, estimated elsewhere [grey level^2].
template <int Unknowns>
[[nodiscard]] InnerFit fit_inner(const InnerPixels& pixels, const InnerPrior& prior, double noise_variance,
                                 double outwards);

extern template InnerEstimate gauss_newton<kUnknownsOnBorder>(const InnerSums&, double, const InnerPrior&,
                                                              const InnerVector&, const InnerVector&);
extern template InnerFit fit_inner<kUnknownsOnBorder>(const InnerPixels&, const InnerPrior&, double, double);
extern template InnerFit fit_inner<kInnerUnknowns>(const InnerPixels&, const InnerPrior&, double, double);

/// Estimate of the edges, including model errors. It is the mean over the models with and without growth of
/// white and slopes of the levels, weighted by their probabilities (Hoeting et al., "Bayesian model
/// averaging: a tutorial", 1999).
[[nodiscard]] InnerEstimate averaged(const InnerFit& fit, const InnerPrior& prior);

/// Standard deviation [px] of the growth model's error. A blur is not exactly Gaussian, in particular if the
/// image was overexposed and then interpolated, scaled or compressed.
[[nodiscard]] double growth_sigma_px(const InnerVector& x);

/// Derivatives of (kFrom, kTo) of the four edges outwards with respect to the unknowns [px].
using EdgesByInner = Eigen::Matrix<double, 8, kInnerUnknowns>;
[[nodiscard]] EdgesByInner edges_by_growth(const InnerVector& x, double outwards);

/// Correction of the border edges by the bits inside: outward displacement (kFrom, kTo) of the four edges
/// [px], and its covariance.
struct EdgeCorrection {
  Eigen::Matrix<double, 8, 1> outwards_px = Eigen::Matrix<double, 8, 1>::Zero();
  Eigen::Matrix<double, 8, 8> covariance_px2 = Eigen::Matrix<double, 8, 8>::Zero();
  double worst_sigmas =
      0;  ///< distance of an edge from its position according to the bits alone, over its standard deviation
};

/// Corrects the edges of `estimate` for two effects that a border alone cannot separate from its position.
/// One is growth of white into black (gamma, bloom, ink), the other grey levels that increase along an edge
/// (shadow, veil, uneven illumination). Growth of white moves left and right edges in opposite directions, so
/// the edges between bits reveal it. Each of the two effects is present or absent (Hoeting et al., "Bayesian
/// model averaging: a tutorial", 1999). O(pixels), at most some hundred; allocates nothing.
[[nodiscard]] EdgeCorrection inner_correction(const ImageView& image, const TagId& id, const TagBands& tag,
                                              const TagEstimate& estimate);

}  // namespace waymark::refinement
