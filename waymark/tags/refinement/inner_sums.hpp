#pragma once

// Least squares sums over the pixels inside a tag, as templates over the type of lanes (see lanes.hpp).
#include <cstddef>

#include "waymark/tags/refinement/lanes.hpp"

namespace waymark::refinement {

/// Unknowns fitted to the pixels inside the border. s runs along TL-TR and t along TR-BR, both from -1 to 1.
enum InnerUnknown : unsigned char {
  kBlack,   ///< [grey level] in the middle of the tag
  kBlackS,  ///< [grey level] change from the middle to s = 1
  kBlackT,
  kWhite,  ///< [grey level] step from black to white in the middle of the tag
  kWhiteS,
  kWhiteT,
  kGrowth,  ///< growth of white, in blurs
  kBlurS,   ///< logarithm of the blur's standard deviation [px] across columns
  kBlurT,   ///< the same across rows
  kShiftS,  ///< displacement of the pattern from its position within the border, in blurs
  kShiftT,
  kStretchS,  ///< displacement proportional to s; the value is that at s = 1
  kStretchT,
  kShearS,  ///< displacement proportional to t for lines between columns, and to s for lines between rows
  kShearT,
  kTaperS,  ///< change in the stretch, proportional in the same way
  kTaperT,
  kSqueezeS,  ///< displacement proportional to s^2, as from lens distortion, or to t^2 for lines between rows
  kSqueezeT,
  kBendS,  ///< displacement proportional to t^2 for lines between columns, and to s^2 for lines between rows
  kBendT
};
inline constexpr int kInnerUnknowns = kBendT + 1;
inline constexpr int kUnknownsOnBorder = kStretchT + 1;  ///< if the border places the pattern

/// Pixels inside the border of a tag and the cells around them, kLanes of each.
struct alignas(kLanes * sizeof(float)) InnerBlock {
  float value[kLanes];           ///< grey level, corrected for illumination
  float weight[kLanes];          ///< 0 or 1
  float s[kLanes];               ///< position along TL-TR, from -1 to 1 inside the border
  float t[kLanes];               ///< the same along TR-BR
  float past_px[2][3][kLanes];   ///< distance beyond the three nearest column (row) boundaries
  float px_per_cell[2][kLanes];  ///< across columns and rows
  float place[2][3][kLanes];     ///< positions of those boundaries, from -1 to 1
  float skew[kLanes];            ///< cosine of the angle between the normals of columns and rows
  float white[4][4][kLanes];     ///< share of white in the cells around each pixel, as rows by columns
};

/// The point at which the model is linearised.
struct InnerPoint {
  float x[kInnerUnknowns];
  float inverse_blur[2];  ///< across columns and rows [1/px]
  float keystone[2];      ///< displacement of the middle because the edges of the border are rotated [px]
  float outwards;         ///< direction from an edge of the border to the middle of white
  float trusted;          ///< larger residuals are given less weight [grey level]
  bool skew_matters;      ///< see InnerPixels
};

/// Sums over all pixels. Only the upper triangle of the information matrix is set.
struct InnerFloats {
  float information[kInnerUnknowns][kInnerUnknowns];
  float gradient[kInnerUnknowns];
  float cost, pixels;
};

using SumInner = void (*)(const InnerBlock* blocks, std::size_t count, const InnerPoint& x,
                          InnerFloats& sums);
/// The sums for kUnknownsOnBorder and for kInnerUnknowns unknowns.
struct InnerKernels {
  SumInner on_border;
  SumInner all;
};
[[nodiscard]] InnerKernels portable_inner_kernels();
/// Available if the program was built for x86-64. Requires a processor with AVX2 and FMA.
[[nodiscard]] InnerKernels avx2_inner_kernels();
/// The fastest implementation that this processor can run.
[[nodiscard]] InnerKernels fastest_inner_kernels();

namespace inner {

/// In blurs: up to this growth, the second-order expansion is accurate to a thousandth of the step.
inline constexpr float kMaxSmallGrowth = 0.3F;

/// Share of white at several pixels, and its derivatives.
template <class L>
struct Share {
  L white, growth;
  L blur[2], shift[2], stretch[2], squeeze[2];  ///< across columns and rows
};

/// The pattern across one axis: derivatives of the share of white with respect to displacements of its lines.
template <class L>
struct Across {
  L moved = L::Zero(), stretched = L::Zero(), squeezed = L::Zero(), blurred = L::Zero();
  L grown = L::Zero();   ///< if white grows by one more blur
  L growth = L::Zero();  ///< contribution of the growth itself to the share of white
};

/// The blurred lines between cells. For the nearest three across each axis, `z` is the distance of a pixel in
/// blurs, and `density` is the normal density there. `part` is the share of the blurred pixel in the four
/// columns and rows.
template <class L>
struct Lines {
  L z[2][3], density[2][3], part[2][4];
};

/// Lines where white begins move by 1 - place; those where it ends move by 1 + place in the opposite
/// direction.
template <class L>
[[gnu::always_inline]] inline void add_large_growth(const L& edges, const L& jump, const L& z, const L& at,
                                                    const L& place, float growth, Across<L>& sum) {
  const L begins = 0.5F * (edges + jump);
  const L ends = 0.5F * (edges - jump);
  const NormalLanes<L> here = normal_lanes<L>(z);
  const NormalLanes<L> begin = normal_lanes<L>(z + (1.0F - place) * growth);
  const NormalLanes<L> end = normal_lanes<L>(z - (1.0F + place) * growth);
  const L density_jump = begins * begin.pdf - ends * end.pdf;
  sum.moved -= density_jump;
  sum.stretched -= at * density_jump;
  sum.squeezed -= at.square() * density_jump;
  sum.blurred -= z * density_jump;
  sum.grown += begins * (1.0F - place) * begin.pdf + ends * (1.0F + place) * end.pdf;
  sum.growth += begins * (begin.cdf - here.cdf) + ends * (here.cdf - end.cdf);
}

/// Adds line `i` across `axis`, weighted by the shares of the four rows across it. `jump` is by how much more
/// white is behind it than before it. `edges` is how much of it has white on one side only.
template <int axis, class L>
[[gnu::always_inline]] inline void add_line(const InnerBlock& block, int i, const Lines<L>& lines, L& jump,
                                            L& edges) {
  for (int j = 0; j < 4; ++j) {
    const L before = load<L>(axis == 0 ? block.white[j][i] : block.white[i][j]);
    const L after = load<L>(axis == 0 ? block.white[j][i + 1] : block.white[i + 1][j]);
    const L& part = lines.part[1 - axis][j];
    jump += part * (after - before);
    edges += part * (before + after - 2.0F * before * after);
  }
}

template <int axis, class L>
[[gnu::always_inline]] inline Across<L> across(const InnerBlock& block, const Lines<L>& lines, float outwards,
                                               float growth) {
  const bool is_large = growth > kMaxSmallGrowth || growth < -kMaxSmallGrowth;
  Across<L> sum;
  for (int i = 0; i < 3; ++i) {
    L jump = L::Zero();
    L edges = L::Zero();
    add_line<axis, L>(block, i, lines, jump, edges);
    const L& z = lines.z[axis][i];
    const L at = load<L>(block.place[axis][i]);
    // The fitted border is the true one minus the growth, so the lines inside are stretched with it.
    const L place = outwards * at;
    if (is_large) {
      add_large_growth<L>(edges, jump, z, at, place, growth, sum);
      continue;
    }
    const L first = edges - place * jump;
    const L second = (1.0F + place.square()) * jump - 2.0F * place * edges;
    const L& density = lines.density[axis][i];
    const L slope = density * jump;
    sum.moved -= slope;
    sum.stretched -= slope * at;
    sum.squeezed -= slope * at.square();
    sum.blurred -= slope * z;
    sum.grown += density * (first - growth * z * second);
    sum.growth += density * growth * (first - 0.5F * growth * z * second);
  }
  return sum;
}

/// Displacement of the lines across one axis, in blurs: a constant part, a part proportional to s or t, and
/// one proportional to its square.
template <class L>
struct Offset {
  L shift, stretch;
  float squeeze;
};

template <int kUnknowns, class L>
[[gnu::always_inline]] inline Offset<L> offset(const InnerPoint& point, int axis, const L& beside) {
  const float* x = point.x + axis;
  if constexpr (kUnknowns == kUnknownsOnBorder) {
    return {L::Constant(x[kShiftS]), L::Constant(x[kStretchS]), 0.0F};
  } else {
    return {x[kShiftS] + x[kShearS] * beside + x[kBendS] * beside.square(),
            x[kStretchS] + x[kTaperS] * beside, x[kSqueezeS]};
  }
}

/// Change in the share of white because columns and rows are not orthogonal. The displacements of a blurred
/// point across them are then correlated (first order of the bivariate normal distribution).
template <class L>
[[gnu::always_inline]] inline L by_skew(const InnerBlock& block, const Lines<L>& lines) {
  L sum = L::Zero();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      sum += lines.density[1][row] * lines.density[0][column] *
             (load<L>(block.white[row][column]) - load<L>(block.white[row][column + 1]) -
              load<L>(block.white[row + 1][column]) + load<L>(block.white[row + 1][column + 1]));
  return load<L>(block.skew) * sum;
}

/// A border with rotated edges (`keystone`) has the wrong perspective, which displaces its middle by the same
/// amount.
template <int kUnknowns, class L>
[[gnu::always_inline]] inline Lines<L> lines_near(const InnerBlock& block, const InnerPoint& point,
                                                  const L& s, const L& t) {
  Lines<L> lines;
  for (int axis = 0; axis < 2; ++axis) {
    const Offset<L> moved = offset<kUnknowns, L>(point, axis, axis == 0 ? t : s);
    const float inverse_blur = point.inverse_blur[axis];
    const L tapered = point.keystone[axis] * inverse_blur * load<L>(block.px_per_cell[axis]) *
                      load<L>(block.px_per_cell[1 - axis]).inverse();
    L rest = L::Constant(1.0F);
    for (int i = 0; i < 3; ++i) {
      const L place = load<L>(block.place[axis][i]);
      const L square = place.square();
      lines.z[axis][i] = load<L>(block.past_px[axis][i]) * inverse_blur - moved.shift -
                         moved.stretch * place - moved.squeeze * square + tapered * (1.0F - square);
      const NormalLanes<L> normal = normal_lanes<L>(lines.z[axis][i]);
      lines.density[axis][i] = normal.pdf;
      lines.part[axis][i] = rest - normal.cdf;
      rest = normal.cdf;
    }
    lines.part[axis][3] = rest;
  }
  return lines;
}

/// Accurate to second order for a small growth and exact otherwise; accurate to first order in the shift.
template <int kUnknowns, class L>
[[gnu::always_inline]] inline Share<L> share_of_white(const InnerBlock& block, const InnerPoint& point,
                                                      const L& s, const L& t) {
  const Lines<L> lines = lines_near<kUnknowns, L>(block, point, s, t);
  L white = L::Zero();
  for (int row = 0; row < 4; ++row) {
    L in_row = L::Zero();
    for (int column = 0; column < 4; ++column)
      in_row += lines.part[0][column] * load<L>(block.white[row][column]);
    white += lines.part[1][row] * in_row;
  }
  if (point.skew_matters) white += by_skew<L>(block, lines);
  const float growth = point.x[kGrowth];
  const Across<L> a = across<0, L>(block, lines, point.outwards, growth);
  const Across<L> b = across<1, L>(block, lines, point.outwards, growth);
  return {white + a.growth + b.growth, a.grown + b.grown,          {a.blurred, b.blurred},
          {a.moved, b.moved},          {a.stretched, b.stretched}, {a.squeezed, b.squeezed}};
}

/// Derivatives of the grey level with respect to the unknowns.
template <int kUnknowns, class L>
[[gnu::always_inline]] inline void slopes(const Share<L>& share, const L& step, const L& s, const L& t,
                                          L* slope) {
  slope[kBlack] = L::Constant(1.0F);
  slope[kBlackS] = s;
  slope[kBlackT] = t;
  slope[kWhite] = share.white;
  slope[kWhiteS] = share.white * s;
  slope[kWhiteT] = share.white * t;
  slope[kGrowth] = step * share.growth;
  for (int axis = 0; axis < 2; ++axis) {
    slope[kBlurS + axis] = step * share.blur[axis];
    slope[kShiftS + axis] = step * share.shift[axis];
    slope[kStretchS + axis] = step * share.stretch[axis];
    if constexpr (kUnknowns == kInnerUnknowns) {
      const L& beside = axis == 0 ? t : s;
      slope[kShearS + axis] = slope[kShiftS + axis] * beside;
      slope[kTaperS + axis] = slope[kStretchS + axis] * beside;
      slope[kSqueezeS + axis] = step * share.squeeze[axis];
      slope[kBendS + axis] = slope[kShiftS + axis] * beside.square();
    }
  }
}

template <int kUnknowns, class L>
void sum_inner(const InnerBlock* blocks, std::size_t count, const InnerPoint& point, InnerFloats& sums) {
  constexpr std::size_t kSize = kUnknowns;
  L information[kSize][kSize];
  L gradient[kSize];
  for (int i = 0; i < kUnknowns; ++i) {
    gradient[i] = L::Zero();
    for (int k = i; k < kUnknowns; ++k) information[i][k] = L::Zero();
  }
  L cost = L::Zero();
  L pixels = L::Zero();
  const float* x = point.x;
  for (std::size_t b = 0; b < count; ++b) {
    const InnerBlock& block = blocks[b];
    const L s = load<L>(block.s);
    const L t = load<L>(block.t);
    const Share<L> share = share_of_white<kUnknowns, L>(block, point, s, t);
    const L step = x[kWhite] + x[kWhiteS] * s + x[kWhiteT] * t;
    const L predicted = x[kBlack] + x[kBlackS] * s + x[kBlackT] * t + step * share.white;
    const L value = load<L>(block.value);
    const L residual = value - predicted;
    // The weight is from Huber, "Robust estimation of a location parameter", 1964.
    L weight = load<L>(block.weight) * (point.trusted * L(residual.abs().max(1e-3F)).inverse()).min(1.0F);
    weight *= within_scale<L>(value, predicted);
    L slope[kSize];
    slopes<kUnknowns, L>(share, step, s, t, slope);
    for (int i = 0; i < kUnknowns; ++i) {
      const L weighted = weight * slope[i];
      for (int k = i; k < kUnknowns; ++k) information[i][k] += weighted * slope[k];
      gradient[i] += weighted * residual;
    }
    cost += weight * residual.square();
    pixels += weight;
  }
  for (int i = 0; i < kUnknowns; ++i) {
    for (int k = i; k < kUnknowns; ++k) sums.information[i][k] = information[i][k].sum();
    sums.gradient[i] = gradient[i].sum();
  }
  sums.cost = cost.sum();
  sums.pixels = pixels.sum();
}

template <class L>
InnerKernels kernels() {
  return {sum_inner<kUnknownsOnBorder, L>, sum_inner<kInnerUnknowns, L>};
}

}  // namespace inner
}  // namespace waymark::refinement
