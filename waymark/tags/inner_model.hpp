#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "waymark/tags/inner_bits.hpp"

namespace waymark::refinement {

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

/// Light that grows along an edge looks like an edge that turns (corner_covariance.cpp): outward displacement
/// of its end [px] for each grey level that the middle between black and white gains there.
[[nodiscard]] double px_per_level(const InnerVector& x, double outwards);

}  // namespace waymark::refinement
