#include "waymark/tags/inner_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "waymark/tags/edge_sums.hpp"
#include "waymark/tags/inner_bits.hpp"

namespace waymark::refinement {
namespace {

/// In blurs: up to here the expansion to second order is off by a thousandth of the step.
constexpr float kLargeGrowth = 0.3F;

/// Share of white at some pixels, and its derivatives.
struct Share {
  Lanes white, growth;
  std::array<Lanes, 2> blur, shift, stretch, squeeze;  ///< across columns, rows
};

/// The pattern across one axis: derivatives of the share of white by what moves its lines. `cross` holds how
/// much each of the four rows across counts, `density` and `z` belong to the three lines.
struct Across {
  Lanes moved = Lanes::Zero();
  Lanes stretched = Lanes::Zero();
  Lanes squeezed = Lanes::Zero();
  Lanes blurred = Lanes::Zero();
  Lanes grown = Lanes::Zero();   ///< by one blur more
  Lanes growth = Lanes::Zero();  ///< what the growth itself adds to the share
};

Across across(const InnerPixels::Block& block, std::size_t axis, const std::array<Lanes, 4>& cross,
              const std::array<Lanes, 3>& z, const std::array<Lanes, 3>& density, float outwards,
              float growth) {
  Across sum;
  for (std::size_t i = 0; i < 3; ++i) {
    Lanes jump = Lanes::Zero();   // to white, where it is
    Lanes edges = Lanes::Zero();  // of either kind
    for (std::size_t j = 0; j < 4; ++j) {
      const Lanes& before = axis == 0 ? block.white[j][i] : block.white[i][j];
      const Lanes& after = axis == 0 ? block.white[j][i + 1] : block.white[i + 1][j];
      jump += cross[j] * (after - before);
      edges += cross[j] * (before + after - 2.0F * before * after);
    }
    // The border that was fitted is the true one less the growth: the lines inside are stretched with it.
    const Lanes place = outwards * block.place[axis][i];
    if (std::abs(growth) > kLargeGrowth) {
      // Lines where white begins move by 1 - place, those where it ends by 1 + place the other way.
      const Lanes begins = 0.5F * (edges + jump);
      const Lanes ends = 0.5F * (edges - jump);
      const NormalLanes<Lanes> here = normal_lanes<Lanes>(z[i]);
      const NormalLanes<Lanes> begin = normal_lanes<Lanes>(z[i] + (1.0F - place) * growth);
      const NormalLanes<Lanes> end = normal_lanes<Lanes>(z[i] - (1.0F + place) * growth);
      const Lanes density_jump = begins * begin.pdf - ends * end.pdf;
      sum.moved -= density_jump;
      sum.stretched -= block.place[axis][i] * density_jump;
      sum.squeezed -= block.place[axis][i].square() * density_jump;
      sum.blurred -= z[i] * density_jump;
      sum.grown += begins * (1.0F - place) * begin.pdf + ends * (1.0F + place) * end.pdf;
      sum.growth += begins * (begin.cdf - here.cdf) + ends * (here.cdf - end.cdf);
      continue;
    }
    const Lanes first = edges - place * jump;
    const Lanes second = (1.0F + place.square()) * jump - 2.0F * place * edges;
    sum.moved -= density[i] * jump;
    sum.stretched -= density[i] * block.place[axis][i] * jump;
    sum.squeezed -= density[i] * block.place[axis][i].square() * jump;
    sum.blurred -= density[i] * z[i] * jump;
    sum.grown += density[i] * (first - growth * z[i] * second);
    sum.growth += density[i] * growth * (first - 0.5F * growth * z[i] * second);
  }
  return sum;
}

/// How far the ends of the border edges along s and along t lie further outwards than they were found, at
/// s = 1 and t = 1 [px].
std::array<double, 2> turns(const InnerVector& x, double outwards) {
  const double px = px_per_level(x, outwards);
  return {px * (x[kBlackS] + 0.5 * x[kWhiteS]), px * (x[kBlackT] + 0.5 * x[kWhiteT])};
}

/// How far the lines of one axis lie beside their place, in blurs: in the middle, and more of it at s or t
/// = 1.
struct Offset {
  Lanes shift, stretch;
  float squeeze = 0;
};

template <int Unknowns>
std::array<Offset, 2> offsets(const InnerPixels::Block& block, const InnerVector& x) {
  const auto of = [&x](InnerUnknown i) { return static_cast<float>(x[i]); };
  if constexpr (Unknowns == kUnknownsOnBorder) {
    return {Offset{Lanes::Constant(of(kShiftS)), Lanes::Constant(of(kStretchS))},
            {Lanes::Constant(of(kShiftT)), Lanes::Constant(of(kStretchT))}};
  } else {
    return {Offset{of(kShiftS) + of(kShearS) * block.t + of(kBendS) * block.t.square(),
                   of(kStretchS) + of(kTaperS) * block.t, of(kSqueezeS)},
            {of(kShiftT) + of(kShearT) * block.s + of(kBendT) * block.s.square(),
             of(kStretchT) + of(kTaperT) * block.s, of(kSqueezeT)}};
  }
}

/// To second order in a small growth, else exactly; to first order in the shift. A border whose edges turned
/// (`keystone`) has the wrong perspective: its middle lies off by as much.
template <int Unknowns>
Share share_of_white(const InnerPixels::Block& block, const InnerVector& x, float outwards,
                     const std::array<double, 2>& keystone) {
  const auto growth = static_cast<float>(x[kGrowth]);
  std::array<std::array<Lanes, 3>, 2> z;
  std::array<std::array<Lanes, 3>, 2> density;
  std::array<std::array<Lanes, 4>, 2> part;  // of the blurred pixel in the four columns, rows
  const std::array<Offset, 2> offset = offsets<Unknowns>(block, x);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto inverse_blur = static_cast<float>(std::exp(-x[axis == 0 ? kBlurS : kBlurT]));
    const Lanes tapered = static_cast<float>(keystone[axis]) * inverse_blur * block.px_per_cell[axis] /
                          block.px_per_cell[1 - axis];
    Lanes rest = Lanes::Ones();
    for (std::size_t i = 0; i < 3; ++i) {
      z[axis][i] = block.past_px[axis][i] * inverse_blur - offset[axis].shift -
                   offset[axis].stretch * block.place[axis][i] -
                   offset[axis].squeeze * block.place[axis][i].square() +
                   tapered * (1.0F - block.place[axis][i].square());
      const NormalLanes<Lanes> normal = normal_lanes<Lanes>(z[axis][i]);
      density[axis][i] = normal.pdf;
      part[axis][i] = rest - normal.cdf;
      rest = normal.cdf;
    }
    part[axis][3] = rest;
  }
  Lanes white = Lanes::Zero();
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      white += part[1][row] * part[0][column] * block.white[row][column];
  const Across s = across(block, 0, part[1], z[0], density[0], outwards, growth);
  const Across t = across(block, 1, part[0], z[1], density[1], outwards, growth);
  return {white + s.growth + t.growth, s.grown + t.grown,          {s.blurred, t.blurred},
          {s.moved, t.moved},          {s.stretched, t.stretched}, {s.squeezed, t.squeezed}};
}

}  // namespace

double mean_blur_px(const InnerVector& x) { return std::exp(0.5 * (x[kBlurS] + x[kBlurT])); }

double px_per_level(const InnerVector& x, double outwards) {
  return 2.0 * std::sqrt(std::numbers::pi) * mean_blur_px(x) / x[kWhite] * outwards;
}

template <int Unknowns>
InnerSums sum_up(const InnerPixels& pixels, const InnerVector& x, double outwards, double trusted) {
  constexpr auto kCount = static_cast<std::size_t>(Unknowns);
  std::array<std::array<Lanes, kCount>, kCount> information;
  std::array<Lanes, kCount> gradient;
  for (auto& row : information) row.fill(Lanes::Zero());
  gradient.fill(Lanes::Zero());
  Lanes cost = Lanes::Zero();
  Lanes count = Lanes::Zero();
  constexpr bool kOnBorder = Unknowns == kUnknownsOnBorder;
  const std::array<double, 2> keystone = kOnBorder ? turns(x, outwards) : std::array<double, 2>{};
  const auto of = [&x](InnerUnknown i) { return static_cast<float>(x[i]); };
  for (std::size_t b = 0; b < pixels.blocks(); ++b) {
    const InnerPixels::Block& block = pixels.block[b];
    const Share share = share_of_white<Unknowns>(block, x, static_cast<float>(outwards), keystone);
    const Lanes step = of(kWhite) + of(kWhiteS) * block.s + of(kWhiteT) * block.t;
    const Lanes predicted = of(kBlack) + of(kBlackS) * block.s + of(kBlackT) * block.t + step * share.white;
    const Lanes residual = block.value - predicted;
    // Huber, "Robust estimation of a location parameter", 1964.
    Lanes weight = block.weight * (static_cast<float>(trusted) / residual.abs().max(1e-3F)).min(1.0F);
    weight *= sums::within_scale<Lanes>(block.value, predicted);
    std::array<Lanes, kCount> slope;
    slope[kBlack] = Lanes::Ones();
    slope[kBlackS] = block.s;
    slope[kBlackT] = block.t;
    slope[kWhite] = share.white;
    slope[kWhiteS] = share.white * block.s;
    slope[kWhiteT] = share.white * block.t;
    slope[kGrowth] = step * share.growth;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      slope[kBlurS + axis] = step * share.blur[axis];
      slope[kShiftS + axis] = step * share.shift[axis];
      slope[kStretchS + axis] = step * share.stretch[axis];
      if constexpr (!kOnBorder) {
        const Lanes& beside = axis == 0 ? block.t : block.s;
        slope[kShearS + axis] = slope[kShiftS + axis] * beside;
        slope[kTaperS + axis] = slope[kStretchS + axis] * beside;
        slope[kSqueezeS + axis] = step * share.squeeze[axis];
        slope[kBendS + axis] = slope[kShiftS + axis] * beside.square();
      }
    }
    for (std::size_t i = 0; i < kCount; ++i) {
      const Lanes weighted = weight * slope[i];
      for (std::size_t k = i; k < kCount; ++k) information[i][k] += weighted * slope[k];
      gradient[i] += weighted * residual;
    }
    cost += weight * residual.square();
    count += weight;
  }
  InnerSums sums;
  for (int i = 0; i < Unknowns; ++i) {
    const auto row = static_cast<std::size_t>(i);
    for (int k = i; k < Unknowns; ++k)
      sums.information(i, k) = sums.information(k, i) =
          static_cast<double>(information[row][static_cast<std::size_t>(k)].sum());
    sums.gradient[i] = static_cast<double>(gradient[row].sum());
  }
  sums.cost = static_cast<double>(cost.sum());
  sums.pixels = static_cast<double>(count.sum());
  return sums;
}

template InnerSums sum_up<kUnknownsOnBorder>(const InnerPixels&, const InnerVector&, double, double);
template InnerSums sum_up<kInnerUnknowns>(const InnerPixels&, const InnerVector&, double, double);

}  // namespace waymark::refinement
