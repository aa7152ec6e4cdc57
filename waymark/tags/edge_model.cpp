#include "waymark/tags/edge_model.hpp"

#include <cmath>
#include <cstddef>

namespace waymark::refinement {
namespace {

struct FloatParameters {
  float from, to, bend, beyond, inner, step, inverse_blur;
  explicit FloatParameters(const EdgeVector& x)
      : from(static_cast<float>(x[kFrom])),
        to(static_cast<float>(x[kTo])),
        bend(static_cast<float>(x[kBend])),
        beyond(static_cast<float>(x[kBeyond])),
        inner(static_cast<float>(x[kInnerLevel])),
        step(static_cast<float>(x[kStep])),
        inverse_blur(static_cast<float>(std::exp(-x[kLogBlur]))) {}
};

/// The model and its derivatives at the same pixel of several slices. The derivative by the displacement is
/// `shift`; how it splits into kFrom, kTo and kBend depends on the slice alone.
struct Prediction {
  Lanes f, h;         ///< derivatives by kStep and kBeyond
  Lanes shift, blur;  ///< derivatives by displacement and kLogBlur
};

template <bool kCells>
Prediction predict(const Band& band, const FloatParameters& x, std::size_t b, std::size_t j,
                   const Lanes& distance_px) {
  const Lanes z = distance_px * x.inverse_blur;
  const NormalLanes edge = normal_lanes(z);
  if constexpr (!kCells) {
    const Lanes slope = -x.step * edge.pdf;
    return {edge.cdf, Lanes::Zero(), x.inverse_blur * slope, slope * z};
  } else {
    const Lanes z_behind = (-distance_px - band.behind_px[b]) * x.inverse_blur;
    const Lanes z_beyond = (distance_px - band.beyond_px[b]) * x.inverse_blur;
    const NormalLanes behind = normal_lanes(z_behind);
    const NormalLanes beyond = normal_lanes(z_beyond);
    const Lanes& inside = band.inside[b][j];
    const Lanes& row_behind = band.behind[b][j];
    const Lanes& row_beyond = band.beyond[b][j];
    const float unknown = band.beyond_known ? 0.0F : 1.0F;
    // Slopes by distance, in units of 1 / blur.
    const Lanes edge_slope = x.step * (inside * edge.pdf);
    const Lanes behind_slope = x.step * (row_behind * behind.pdf);
    const Lanes beyond_slope = (x.step * row_beyond + unknown * x.beyond) * beyond.pdf;
    return {1.0F - inside * (1.0F - edge.cdf) + row_behind * behind.cdf + row_beyond * beyond.cdf,
            unknown * beyond.cdf, -x.inverse_blur * (edge_slope - behind_slope + beyond_slope),
            -(edge_slope * z + behind_slope * z_behind + beyond_slope * z_beyond)};
  }
}

/// Sums over all pixels, by lanes. Pairs of derivatives are numbered as in NormalEquations.
struct Sums {
  std::array<std::array<Lanes, kParameters>, kParameters> information;
  std::array<Lanes, kParameters> gradient;
  Lanes cost = Lanes::Zero();
  Lanes flat_cost = Lanes::Zero();
  Lanes flat_pixels = Lanes::Zero();
  Lanes light_information = Lanes::Zero();
  Lanes light_gradient = Lanes::Zero();
  Sums() {
    for (auto& row : information) row.fill(Lanes::Zero());
    gradient.fill(Lanes::Zero());
  }
};

/// Sums over the pixels of one block of slices that still lack the share of kFrom, kTo and kBend.
struct BlockSums {
  Lanes shift_shift = Lanes::Zero(), shift_beyond = Lanes::Zero(), shift_inner = Lanes::Zero();
  Lanes shift_step = Lanes::Zero(), shift_blur = Lanes::Zero(), shift_residual = Lanes::Zero();
};

void add_block(const BlockSums& block, const Lanes& along, Sums& sums) {
  const std::array<Lanes, 3> share = {0.5F * (1.0F - along), 0.5F * (1.0F + along), 1.0F - along.square()};
  for (std::size_t i = 0; i < 3; ++i) {
    auto& row = sums.information[i];
    const Lanes weighted = block.shift_shift * share[i];
    for (std::size_t k = i; k < 3; ++k) row[k] += weighted * share[k];
    row[kBeyond] += block.shift_beyond * share[i];
    row[kInnerLevel] += block.shift_inner * share[i];
    row[kStep] += block.shift_step * share[i];
    row[kLogBlur] += block.shift_blur * share[i];
    sums.gradient[i] += block.shift_residual * share[i];
  }
}

void add_pixels(const Prediction& p, const Lanes& weight, const Lanes& residual, bool cells, BlockSums& block,
                Sums& sums) {
  const Lanes w_shift = weight * p.shift;
  const Lanes w_f = weight * p.f;
  const Lanes w_blur = weight * p.blur;
  const Lanes w_residual = weight * residual;
  block.shift_shift += w_shift * p.shift;
  block.shift_inner += w_shift;
  block.shift_step += w_shift * p.f;
  block.shift_blur += w_shift * p.blur;
  block.shift_residual += w_shift * residual;
  auto& information = sums.information;
  information[kInnerLevel][kInnerLevel] += weight;
  information[kInnerLevel][kStep] += w_f;
  information[kInnerLevel][kLogBlur] += w_blur;
  information[kStep][kStep] += w_f * p.f;
  information[kStep][kLogBlur] += w_f * p.blur;
  information[kLogBlur][kLogBlur] += w_blur * p.blur;
  sums.gradient[kInnerLevel] += w_residual;
  sums.gradient[kStep] += w_f * residual;
  sums.gradient[kLogBlur] += w_blur * residual;
  if (!cells) return;
  const Lanes w_h = weight * p.h;
  block.shift_beyond += w_shift * p.h;
  information[kBeyond][kBeyond] += w_h * p.h;
  information[kBeyond][kInnerLevel] += w_h;
  information[kBeyond][kStep] += w_h * p.f;
  information[kBeyond][kLogBlur] += w_h * p.blur;
  sums.gradient[kBeyond] += w_h * residual;
}

/// 0 where the model is beyond an end of the scale and the pixel agrees, else 1. The pixel need not be quite
/// at the end: to count the low half of the noise there and not the high one would pull the level down.
Lanes within_scale(const Lanes& value, const Lanes& predicted) {
  constexpr float kNoise = 12.0F;
  const Lanes dark = positive(kDarkest + kNoise - value) * positive(kDarkest - predicted);
  const Lanes bright = positive(value - (kBrightest - kNoise)) * positive(predicted - kBrightest);
  return 1.0F - dark - bright;
}

template <bool kCells, bool kClipped>
Sums sum_up(const Band& band, const FloatParameters& x, float light, SliceCosts& costs) {
  Sums sums;
  // As flat as a blurred edge is two standard deviations away from it.
  const float flat_shift = 0.054F * std::abs(x.step) * x.inverse_blur;
  for (std::size_t b = 0; b < static_cast<std::size_t>(band.blocks); ++b) {
    const Lanes& along = band.along[b];
    const Lanes shift =
        0.5F * (x.from + x.to) + 0.5F * (x.to - x.from) * along + x.bend * (1.0F - along.square());
    const Lanes inverse_light = (1.0F + light * along).inverse();
    BlockSums block;
    Lanes cost = Lanes::Zero();
    Lanes flat_light = Lanes::Zero();
    Lanes flat_residual = Lanes::Zero();
    Lanes distance_px = band.first_px[b] - shift;
    for (std::size_t j = 0; j < static_cast<std::size_t>(band.depth); ++j, distance_px += band.step_px) {
      const Prediction p = predict<kCells>(band, x, b, j, distance_px);
      Lanes predicted = x.inner + x.step * p.f;
      if constexpr (kCells) predicted += x.beyond * p.h;
      Lanes weight = band.weight[b][j];
      if constexpr (kClipped) weight *= within_scale(band.value[b][j], predicted);
      const Lanes residual = inverse_light * band.value[b][j] - predicted;
      add_pixels(p, weight, residual, kCells, block, sums);
      const Lanes square = weight * residual.square();
      const Lanes flat = positive(flat_shift - p.shift.abs());
      sums.flat_cost += flat * square;
      const Lanes flat_weight = flat * weight;
      const Lanes flat_level = flat_weight * predicted;
      sums.flat_pixels += flat_weight;
      if constexpr (!kCells) {  // amid other cells no pixel is flat enough to tell light by
        flat_light += flat_level * predicted;
        flat_residual += flat_level * residual;
      }
      cost += square;
    }
    add_block(block, along, sums);
    sums.light_information += along.square() * flat_light;
    sums.light_gradient += along * flat_residual;
    sums.cost += cost;
    costs[b] = cost;
  }
  return sums;
}

}  // namespace

NormalEquations linearize(const Band& band, const EdgeVector& parameters, double light, SliceCosts& costs) {
  const FloatParameters x(parameters);
  const auto sum_up_this = band.clipped ? (band.cells_matter ? sum_up<true, true> : sum_up<false, true>)
                                        : (band.cells_matter ? sum_up<true, false> : sum_up<false, false>);
  const Sums sums = sum_up_this(band, x, static_cast<float>(light), costs);
  NormalEquations normal;
  for (int i = 0; i < kParameters; ++i) {
    const auto row = static_cast<std::size_t>(i);
    for (int k = i; k < kParameters; ++k) {
      normal.information(i, k) =
          static_cast<double>(sums.information[row][static_cast<std::size_t>(k)].sum());
      normal.information(k, i) = normal.information(i, k);
    }
    normal.gradient[i] = static_cast<double>(sums.gradient[row].sum());
  }
  normal.flat_cost = static_cast<double>(sums.flat_cost.sum());
  normal.flat_pixels = static_cast<double>(sums.flat_pixels.sum());
  normal.light_information = static_cast<double>(sums.light_information.sum());
  normal.light_gradient = static_cast<double>(sums.light_gradient.sum());
  normal.cost = static_cast<double>(sums.cost.sum());
  return normal;
}

}  // namespace waymark::refinement
