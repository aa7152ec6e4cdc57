#pragma once

// Least squares sums over a band, as templates over the type of lanes (see lanes.hpp).
#include <cstddef>

#include "waymark/tags/refinement/lanes.hpp"

namespace waymark::refinement {

/// Parameters of one edge. The first four are specific to the edge; the last three are nearly the same for
/// all edges of a tag.
enum Parameter : int {
  kFrom,  ///< [px] outward displacement of the edge at its first corner
  kTo,    ///< [px] at its second corner
  kBend,  ///< [px] outward bulge halfway between the corners
  /// [grey level] step from the outer ring to the row beyond it, if that row is not printed
  kBeyond,
  kInnerLevel,  ///< [grey level] level of the border
  kStep,        ///< [grey level] step from the border to the ring outside it
  kLogBlur,     ///< ln of the blur's standard deviation in pixels
  kParameters
};

/// The point at which the model is linearised.
struct EdgePoint {
  float from, to, bend, beyond, inner, step, inverse_blur;
  float illumination;  ///< grey levels are (1 + illumination t) times those of the model, with t from -1 to 1
  float flat_shift;  ///< a pixel counts as flat if its derivative with respect to the displacement is smaller
                     ///< [grey level/px]
};

/// A Band as rows of kLanes floats: one row per block of slices, or `depth` rows out of `max_depth`.
struct BandRows {
  int blocks, depth, max_depth;
  float step_px;
  bool cells_matter, beyond_known, clipped;
  const float *along, *first_px, *behind_px, *beyond_px;
  const float *value, *weight, *behind, *beyond, *inside;
};

/// Like NormalEquations (edge_model.hpp), but holds only the upper triangle of the information matrix.
struct EdgeSums {
  float information[kParameters][kParameters];
  float gradient[kParameters];
  float cost, flat_cost, flat_pixels, illumination_information, illumination_gradient;
};

/// Computes the sums over the pixels of a band. `costs` receives the cost of each slice, as `blocks` rows of
/// kLanes. O(pixels).
using SumEdge = EdgeSums (*)(const BandRows& band, const EdgePoint& x, float* costs);
[[nodiscard]] EdgeSums sum_edge_portable(const BandRows& band, const EdgePoint& x, float* costs);
/// Available if the program was built for x86-64. Requires a processor with AVX2 and FMA.
[[nodiscard]] EdgeSums sum_edge_avx2(const BandRows& band, const EdgePoint& x, float* costs);
/// The fastest implementation that this processor can run.
[[nodiscard]] SumEdge fastest_sum_edge();

namespace sums {

/// The model and its derivatives at the same pixel position in several slices. The derivative with respect to
/// the displacement is `shift`; how it is split between kFrom, kTo and kBend depends only on the slice.
template <class L>
struct Prediction {
  L f, h;         ///< derivatives with respect to kStep and kBeyond
  L shift, blur;  ///< derivatives with respect to displacement and kLogBlur
};

template <bool kCells, class L>
[[gnu::always_inline]] inline Prediction<L> predict(const BandRows& band, const EdgePoint& x, std::size_t b,
                                                    std::size_t row, const L& distance_px) {
  const L z = distance_px * x.inverse_blur;
  const NormalLanes<L> edge = normal_lanes<L>(z);
  if constexpr (!kCells) {
    const L slope = -x.step * edge.pdf;
    return {edge.cdf, L::Zero(), x.inverse_blur * slope, slope * z};
  } else {
    const L z_behind = (-distance_px - load<L>(band.behind_px + b * kLanes)) * x.inverse_blur;
    const L z_beyond = (distance_px - load<L>(band.beyond_px + b * kLanes)) * x.inverse_blur;
    const NormalLanes<L> behind = normal_lanes<L>(z_behind);
    const NormalLanes<L> beyond = normal_lanes<L>(z_beyond);
    const L inside = load<L>(band.inside + row);
    const L row_behind = load<L>(band.behind + row);
    const L row_beyond = load<L>(band.beyond + row);
    const float unknown = band.beyond_known ? 0.0F : 1.0F;
    // Slopes with respect to the distance in units of 1 / blur.
    const L edge_slope = x.step * (inside * edge.pdf);
    const L behind_slope = x.step * (row_behind * behind.pdf);
    const L beyond_slope = (x.step * row_beyond + unknown * x.beyond) * beyond.pdf;
    return {1.0F - inside * (1.0F - edge.cdf) + row_behind * behind.cdf + row_beyond * beyond.cdf,
            unknown * beyond.cdf, -x.inverse_blur * (edge_slope - behind_slope + beyond_slope),
            -(edge_slope * z + behind_slope * z_behind + beyond_slope * z_beyond)};
  }
}

/// Sums over all pixels for each lane. Pairs of derivatives are numbered as in EdgeSums.
template <class L>
struct LaneSums {
  L information[kParameters][kParameters];
  L gradient[kParameters];
  L cost = L::Zero(), flat_cost = L::Zero(), flat_pixels = L::Zero();
  L illumination_information = L::Zero(), illumination_gradient = L::Zero();
  LaneSums() {
    for (int i = 0; i < kParameters; ++i) {
      gradient[i] = L::Zero();
      for (int k = 0; k < kParameters; ++k) information[i][k] = L::Zero();
    }
  }
};

/// Sums over the pixels in one block of slices, before they are distributed to kFrom, kTo and kBend.
template <class L>
struct BlockSums {
  L shift_shift = L::Zero(), shift_beyond = L::Zero(), shift_inner = L::Zero();
  L shift_step = L::Zero(), shift_blur = L::Zero(), shift_residual = L::Zero();
};

template <class L>
[[gnu::always_inline]] inline void add_block(const BlockSums<L>& block, const L& along, LaneSums<L>& sums) {
  const L share[] = {0.5F * (1.0F - along), 0.5F * (1.0F + along), 1.0F - along.square()};
  for (int i = 0; i < 3; ++i) {
    L* row = sums.information[i];
    const L weighted = block.shift_shift * share[i];
    for (int k = i; k < 3; ++k) row[k] += weighted * share[k];
    row[kBeyond] += block.shift_beyond * share[i];
    row[kInnerLevel] += block.shift_inner * share[i];
    row[kStep] += block.shift_step * share[i];
    row[kLogBlur] += block.shift_blur * share[i];
    sums.gradient[i] += block.shift_residual * share[i];
  }
}

template <bool kCells, class L>
[[gnu::always_inline]] inline void add_pixels(const Prediction<L>& p, const L& weight, const L& residual,
                                              BlockSums<L>& block, LaneSums<L>& sums) {
  const L w_shift = weight * p.shift;
  const L w_f = weight * p.f;
  const L w_blur = weight * p.blur;
  const L w_residual = weight * residual;
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
  if constexpr (kCells) {
    const L w_h = weight * p.h;
    block.shift_beyond += w_shift * p.h;
    information[kBeyond][kBeyond] += w_h * p.h;
    information[kBeyond][kInnerLevel] += w_h;
    information[kBeyond][kStep] += w_h * p.f;
    information[kBeyond][kLogBlur] += w_h * p.blur;
    sums.gradient[kBeyond] += w_h * residual;
  }
}

template <bool kCells, bool kClipped, class L>
void sum_up(const BandRows& band, const EdgePoint& x, float* costs, LaneSums<L>& sums) {
  for (std::size_t b = 0; b < static_cast<std::size_t>(band.blocks); ++b) {
    const L along = load<L>(band.along + b * kLanes);
    const L shift =
        0.5F * (x.from + x.to) + 0.5F * (x.to - x.from) * along + x.bend * (1.0F - along.square());
    const L inverse_illumination = L(1.0F + x.illumination * along).inverse();
    BlockSums<L> block;
    L cost = L::Zero();
    L flat_illumination = L::Zero();
    L flat_residual = L::Zero();
    L distance_px = load<L>(band.first_px + b * kLanes) - shift;
    const std::size_t rows = b * static_cast<std::size_t>(band.max_depth) * kLanes;
    for (int j = 0; j < band.depth; ++j, distance_px += L::Constant(band.step_px)) {
      const std::size_t row = rows + static_cast<std::size_t>(j) * kLanes;
      const Prediction<L> p = predict<kCells, L>(band, x, b, row, distance_px);
      L predicted = x.inner + x.step * p.f;
      if constexpr (kCells) predicted += x.beyond * p.h;
      const L value = load<L>(band.value + row);
      L weight = load<L>(band.weight + row);
      if constexpr (kClipped) weight *= within_scale<L>(value, predicted);
      const L residual = inverse_illumination * value - predicted;
      add_pixels<kCells, L>(p, weight, residual, block, sums);
      const L square = weight * residual.square();
      const L flat = positive<L>(x.flat_shift - p.shift.abs());
      sums.flat_cost += flat * square;
      const L flat_weight = flat * weight;
      const L flat_level = flat_weight * predicted;
      sums.flat_pixels += flat_weight;
      if constexpr (!kCells) {  // in bands with other cells, no pixel is flat enough to determine the
                                // illumination
        flat_illumination += flat_level * predicted;
        flat_residual += flat_level * residual;
      }
      cost += square;
    }
    add_block<L>(block, along, sums);
    sums.illumination_information += along.square() * flat_illumination;
    sums.illumination_gradient += along * flat_residual;
    sums.cost += cost;
    store<L>(cost, costs + b * kLanes);
  }
}

template <class L>
EdgeSums sum_edge(const BandRows& band, const EdgePoint& x, float* costs) {
  LaneSums<L> lanes;
  if (band.cells_matter) {
    band.clipped ? sum_up<true, true, L>(band, x, costs, lanes)
                 : sum_up<true, false, L>(band, x, costs, lanes);
  } else {
    band.clipped ? sum_up<false, true, L>(band, x, costs, lanes)
                 : sum_up<false, false, L>(band, x, costs, lanes);
  }
  EdgeSums sums{};
  for (int i = 0; i < kParameters; ++i) {
    for (int k = i; k < kParameters; ++k) sums.information[i][k] = lanes.information[i][k].sum();
    sums.gradient[i] = lanes.gradient[i].sum();
  }
  sums.cost = lanes.cost.sum();
  sums.flat_cost = lanes.flat_cost.sum();
  sums.flat_pixels = lanes.flat_pixels.sum();
  sums.illumination_information = lanes.illumination_information.sum();
  sums.illumination_gradient = lanes.illumination_gradient.sum();
  return sums;
}

}  // namespace sums
}  // namespace waymark::refinement
