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
  static constexpr int kFew = 200;   ///< enough to correct edges that the border has placed
  static constexpr int kMany = 800;  ///< to place them without the border
  static constexpr int kMaxBlocks = 2 * kMany / kLanes;

  struct Block {
    Lanes value;   ///< grey level in even light
    Lanes weight;  ///< 0 or 1
    Lanes s, t;    ///< place along TL-TR and along TR-BR, -1 to 1 inside the border
    std::array<std::array<Lanes, 3>, 2>
        past_px;                       ///< how far past the three nearest lines between columns, rows
    std::array<Lanes, 2> px_per_cell;  ///< across columns, rows
    std::array<std::array<Lanes, 3>, 2> place;  ///< where those lines lie, -1 to 1
    std::array<std::array<Lanes, 4>, 4> white;  ///< rows by columns: share of white of the cells around them
  };
  std::array<Block, kMaxBlocks> block;
  int count = 0;  ///< pixels

  [[nodiscard]] std::size_t blocks() const { return static_cast<std::size_t>((count + kLanes - 1) / kLanes); }
};

/// Reads them where the four border edges of `estimate` say that the cells lie; of large tags `most` (kFew or
/// kMany) that are spread evenly. O(pixels).
void read_inner_pixels(const ImageView& image, const TagId& id, const TagBands& tag,
                       const TagEstimate& estimate, int most, InnerPixels& pixels);

/// What is fitted to the pixels inside the border. s and t run along TL-TR and along TR-BR, -1 to 1.
enum InnerUnknown : std::uint8_t {
  kBlack,   ///< [grey level] in the middle of the tag
  kBlackS,  ///< [grey level] on top of it at s = 1
  kBlackT,
  kWhite,  ///< [grey level] step from black to white in the middle
  kWhiteS,
  kWhiteT,
  kGrowth,  ///< of white, in blurs
  kBlurS,   ///< ln of the standard deviation [px] across columns
  kBlurT,   ///< across rows
  kShiftS,  ///< of the pattern beside the place that the border gives it, in blurs
  kShiftT,
  kStretchS,  ///< the same, growing from the middle to what it is at s = 1
  kStretchT,
  kShearS,  ///< the same, of the lines between columns, growing along t; of those between rows along s
  kShearT,
  kTaperS,  ///< of the stretch, growing likewise
  kTaperT,
  kSqueezeS,  ///< the same, growing with s^2 as a lens does it; of lines between rows with t^2
  kSqueezeT,
  kBendS,  ///< the same, of lines between columns growing with t^2; of those between rows with s^2
  kBendT
};
constexpr int kInnerUnknowns = kBendT + 1;
constexpr int kUnknownsOnBorder = kStretchT + 1;  ///< of a pattern that lies as the border does
using InnerVector = Eigen::Matrix<double, kInnerUnknowns, 1>;
using InnerMatrix = Eigen::Matrix<double, kInnerUnknowns, kInnerUnknowns>;

/// Weighted least squares around some unknowns.
struct InnerSums {
  InnerMatrix information = InnerMatrix::Zero();  ///< of pixels with variance 1
  InnerVector gradient = InnerVector::Zero();
  double cost = 0;
  double pixels = 0;
};

/// `outwards`: which way the middle of white lies from an edge of the border: 1 outwards, -1 inwards
/// (reversed border). Residuals larger than `trusted` [grey level] count less. With kUnknownsOnBorder
/// unknowns the pattern turns as light turned the border's edges; with all, as those unknowns say. O(pixels).
template <int Unknowns>
[[nodiscard]] InnerSums sum_up(const InnerPixels& pixels, const InnerVector& x, double outwards,
                               double trusted);
extern template InnerSums sum_up<kUnknownsOnBorder>(const InnerPixels&, const InnerVector&, double, double);
extern template InnerSums sum_up<kInnerUnknowns>(const InnerPixels&, const InnerVector&, double, double);

/// Standard deviation of the blur [px], mean of both axes.
[[nodiscard]] double mean_blur_px(const InnerVector& x);

/// Light that grows along an edge looks like an edge that turns (tag_fit.cpp): outward displacement
/// of its end [px] for each grey level that the middle between black and white gains there.
[[nodiscard]] double px_per_level(const InnerVector& x, double outwards);

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

/// What the bits inside the border say about the places of the border edges: by how much (kFrom, kTo) of the
/// four edges have to be moved outwards [px], and the covariance of that.
struct EdgeCorrection {
  Eigen::Matrix<double, 8, 1> outwards_px = Eigen::Matrix<double, 8, 1>::Zero();
  Eigen::Matrix<double, 8, 8> covariance_px2 = Eigen::Matrix<double, 8, 8>::Zero();
  double worst_sigmas =
      0;  ///< distance of an edge from where the bits alone would have it, over its deviation
};

/// Corrects the edges of `estimate` for what a border alone cannot tell from its place: white that reaches
/// into black (gamma, bloom, ink) and grey levels that grow along an edge (shadow, veil, uneven light). White
/// that grows moves an edge one way where white lies left of black, and the other way where it lies right of
/// it, so the bits between show it. Each of the two is there or is not (Hoeting et al., "Bayesian model
/// averaging: a tutorial", 1999). O(pixels), at most some hundred; no allocation.
[[nodiscard]] EdgeCorrection inner_correction(const ImageView& image, const TagId& id, const TagBands& tag,
                                              const TagEstimate& estimate);

}  // namespace waymark::refinement
