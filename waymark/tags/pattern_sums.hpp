#pragma once

// The sums of least squares over the pixels of one patch, written once for every type of lanes
// (lane_math.hpp). No Eigen here.
#include <cstddef>

#include "waymark/tags/lane_math.hpp"

namespace waymark::refinement {

/// What moves the grey levels of a patch. The parameters of the whole tag act through these.
enum PatchParameter : int {
  kAlong,       ///< [cell] place of the pattern along u
  kAcross,      ///< [cell] along v
  kBlack,       ///< [grey level]
  kStep,        ///< [grey level] from black to white
  kGrowth,      ///< of white into black, see PatchPoint
  kBlurAlong,   ///< ln of the standard deviation of the blur along u
  kBlurAcross,  ///< along v
  kBlurSkew,    ///< [cell^2] covariance of the blur along u and v
  kBeyond,      ///< share of white beyond the margin
  kPatchParameters
};

/// Grey levels at or beyond these are what the sensor could not show.
inline constexpr float kDarkest = 1.0F;
inline constexpr float kBrightest = 253.0F;

inline constexpr int kMaxSteps = 4;  ///< borders of cells along a side of the window around a patch

/// The cells around a patch: `steps` + 1 by `steps` + 1 of them, cell (0, 0) without an end towards smaller u
/// and v, the last ones without an end towards larger.
struct PatchWindow {
  int steps = 2;
  float first_u = 0, first_v = 0;  ///< [cell] the first border; the next ones are a cell apart
  float share[kMaxSteps + 1][kMaxSteps + 1] = {};  ///< of white, by rows
  /// Where beyond the margin lies: past this line of u (or v), 0 where it is too far to matter.
  float rim_sign = 0;
  float rim_at = 0;
  bool rim_along_u = false;
};

/// The parameters at which the model of a patch is developed.
struct PatchPoint {
  float cell_H_x[9];                     ///< x, y of a pixel to cells u, v
  float inverse_blur_u, inverse_blur_v;  ///< [1 / cell]
  float blur_uv;                         ///< [cell^2] covariance of the blur
  float black, black_u, black_v;         ///< [grey level] black + black_u u + black_v v
  float step, step_u, step_v;
  float growth;  ///< shares f of white become f (1 + growth) / (1 + growth f)
  float beyond;  ///< share of white beyond the margin, less one
};

/// Pixels in rows of kLanes.
struct PatchRows {
  int rows = 0;
  bool clipped = false;  ///< whether any is as dark or as bright as a pixel can be
  const float *x, *y, *value, *weight;
};

struct PatchSums {
  float information[kPatchParameters][kPatchParameters];  ///< upper triangle
  float gradient[kPatchParameters];
  float cost, pixels;
};

using SumPatch = void (*)(const PatchRows& rows, const PatchWindow& window, const PatchPoint& at,
                          PatchSums& sums);
void sum_patch_portable(const PatchRows& rows, const PatchWindow& window, const PatchPoint& at,
                        PatchSums& sums);
/// Where the program was built for x86-64; for processors with AVX2 and FMA.
void sum_patch_avx2(const PatchRows& rows, const PatchWindow& window, const PatchPoint& at, PatchSums& sums);
/// The quickest of them that this processor can run.
[[nodiscard]] SumPatch quickest_sum_patch();

namespace sums {

/// Share of white in the blurred pattern and its derivatives.
template <class L>
struct Share {
  L f, by_u, by_v, by_blur_u, by_blur_v, by_blur_uv, by_beyond;
};

template <int kSteps, class L>
struct Steps {
  static constexpr auto kSize = static_cast<std::size_t>(kSteps);
  L cdf[kSize], pdf[kSize], bend[kSize];
  [[gnu::always_inline]] Steps(const L& at, float first, float inverse_blur) {
    for (int a = 0; a < kSteps; ++a) {
      const L z = (at - (first + static_cast<float>(a))) * inverse_blur;
      const NormalLanes<L> normal = normal_lanes<L>(z);
      cdf[a] = normal.cdf;
      pdf[a] = normal.pdf * inverse_blur;
      bend[a] = -(z * normal.pdf);
    }
  }
};

template <int kSteps, class L>
[[gnu::always_inline]] inline Share<L> share_of_white(const PatchWindow& w, const PatchPoint& at, const L& u,
                                                      const L& v) {
  const Steps<kSteps, L> along(u, w.first_u, at.inverse_blur_u);
  const Steps<kSteps, L> across(v, w.first_v, at.inverse_blur_v);
  Share<L> s{L::Zero(), L::Zero(), L::Zero(), L::Zero(), L::Zero(), L::Zero(), L::Zero()};
  L turned = L::Zero();
  L turned_u = L::Zero();
  L turned_v = L::Zero();
  L before = L::Zero();
  L before_u = L::Zero();
  L before_blur = L::Zero();
  for (int r = 0; r <= kSteps; ++r) {
    L row = L::Constant(w.share[r][0]);
    L row_u = L::Zero();
    L row_blur = L::Zero();
    for (int a = 0; a < kSteps; ++a) {
      const float jump = w.share[r][a + 1] - w.share[r][a];
      row += jump * along.cdf[a];
      row_u += jump * along.pdf[a];
      row_blur += jump * along.bend[a];
    }
    if (r == 0) {
      s.f = row;
      s.by_u = row_u;
      s.by_blur_u = row_blur;
    } else {
      const L rise = row - before;
      s.f += rise * across.cdf[r - 1];
      s.by_v += rise * across.pdf[r - 1];
      s.by_blur_v += rise * across.bend[r - 1];
      const L rise_u = row_u - before_u;
      const L rise_blur = row_blur - before_blur;
      s.by_u += rise_u * across.cdf[r - 1];
      s.by_blur_u += rise_blur * across.cdf[r - 1];
      s.by_blur_uv += rise_u * across.pdf[r - 1];
      turned += rise_blur * across.bend[r - 1];
      turned_u += rise_blur * across.pdf[r - 1];
      turned_v += rise_u * across.bend[r - 1];
    }
    before = row;
    before_u = row_u;
    before_blur = row_blur;
  }
  // Where the blur is not along u and v: the tetrachoric series of the normal distribution of two variables
  // (Pearson, "On the correlation of characters not quantitatively measurable", Phil. Trans. A 195, 1900).
  const float correlation = at.blur_uv * at.inverse_blur_u * at.inverse_blur_v;
  s.f += at.blur_uv * s.by_blur_uv + (0.5F * correlation * correlation) * turned;
  s.by_u += (at.blur_uv * at.inverse_blur_u * at.inverse_blur_u) * turned_u;
  s.by_v += (at.blur_uv * at.inverse_blur_v * at.inverse_blur_v) * turned_v;
  return s;
}

template <class L>
[[gnu::always_inline]] inline void add_beyond(const PatchWindow& w, const PatchPoint& at, const L& u,
                                              const L& v, Share<L>& s) {
  const float inverse_blur = w.rim_along_u ? at.inverse_blur_u : at.inverse_blur_v;
  const L z = w.rim_sign * ((w.rim_along_u ? u : v) - w.rim_at) * inverse_blur;
  const NormalLanes<L> normal = normal_lanes<L>(z);
  const L slope = at.beyond * w.rim_sign * inverse_blur * normal.pdf;
  const L bend = -(at.beyond * (z * normal.pdf));
  s.f += at.beyond * normal.cdf;
  s.by_beyond = normal.cdf;
  if (w.rim_along_u) {
    s.by_u += slope;
    s.by_blur_u += bend;
  } else {
    s.by_v += slope;
    s.by_blur_v += bend;
  }
}

/// 0 where the model is beyond an end of the scale and the pixel agrees, else 1. The pixel need not be quite
/// at the end: to count the low half of the noise there and not the high one would pull the level down.
template <class L>
[[gnu::always_inline]] inline L within_scale(const L& value, const L& predicted) {
  constexpr float kNoise = 12.0F;
  const L dark = positive<L>(kDarkest + kNoise - value) * positive<L>(kDarkest - predicted);
  const L bright = positive<L>(value - (kBrightest - kNoise)) * positive<L>(predicted - kBrightest);
  return 1.0F - dark - bright;
}

template <int kSteps, bool kRim, class L>
void sum_up(const PatchRows& rows, const PatchWindow& window, const PatchPoint& at, PatchSums& sums) {
  constexpr int kCount = kRim ? kPatchParameters : kPatchParameters - 1;
  constexpr auto kSize = static_cast<std::size_t>(kCount);
  L information[kSize][kSize];
  L gradient[kSize];
  for (int i = 0; i < kCount; ++i) {
    gradient[i] = L::Zero();
    for (int k = 0; k < kCount; ++k) information[i][k] = L::Zero();
  }
  L cost = L::Zero();
  L pixels = L::Zero();
  const float* H = at.cell_H_x;
  for (int r = 0; r < rows.rows; ++r) {
    const std::size_t row = static_cast<std::size_t>(r) * kLanes;
    const L x = load<L>(rows.x + row);
    const L y = load<L>(rows.y + row);
    const L value = load<L>(rows.value + row);
    L weight = load<L>(rows.weight + row);
    const L inverse_w = (H[6] * x + H[7] * y + H[8]).inverse();
    const L u = (H[0] * x + H[1] * y + H[2]) * inverse_w;
    const L v = (H[3] * x + H[4] * y + H[5]) * inverse_w;
    Share<L> s = share_of_white<kSteps, L>(window, at, u, v);
    if constexpr (kRim) add_beyond<L>(window, at, u, v, s);
    const L f = s.f.max(0.0F).min(1.5F);
    const L bent = (1.0F + at.growth * f).inverse();
    const L white = f * bent * (1.0F + at.growth);
    const L step = at.step + at.step_u * u + at.step_v * v;
    const L predicted = at.black + at.black_u * u + at.black_v * v + step * white;
    if (rows.clipped) weight *= within_scale<L>(value, predicted);
    const L residual = value - predicted;
    const L slope = step * bent * bent * (1.0F + at.growth);
    L d[kPatchParameters];
    d[kAlong] = slope * s.by_u;
    d[kAcross] = slope * s.by_v;
    d[kBlack] = L::Constant(1.0F);
    d[kStep] = white;
    d[kGrowth] = slope * (f * (1.0F - f));
    d[kBlurAlong] = slope * s.by_blur_u;
    d[kBlurAcross] = slope * s.by_blur_v;
    d[kBlurSkew] = slope * s.by_blur_uv;
    if constexpr (kRim) d[kBeyond] = slope * s.by_beyond;
    for (int i = 0; i < kCount; ++i) {
      const L weighted = weight * d[i];
      gradient[i] += weighted * residual;
      for (int k = i; k < kCount; ++k) information[i][k] += weighted * d[k];
    }
    cost += weight * residual.square();
    pixels += weight;
  }
  for (int i = 0; i < kPatchParameters; ++i) {
    sums.gradient[i] = 0;
    for (int k = i; k < kPatchParameters; ++k) sums.information[i][k] = 0;
  }
  for (int i = 0; i < kCount; ++i) {
    sums.gradient[i] = gradient[i].sum();
    for (int k = i; k < kCount; ++k) sums.information[i][k] = information[i][k].sum();
  }
  sums.cost = cost.sum();
  sums.pixels = pixels.sum();
}

template <int kSteps, class L>
void sum_steps(const PatchRows& rows, const PatchWindow& window, const PatchPoint& at, PatchSums& sums) {
  window.rim_sign != 0 ? sum_up<kSteps, true, L>(rows, window, at, sums)
                       : sum_up<kSteps, false, L>(rows, window, at, sums);
}

template <class L>
void sum_patch(const PatchRows& rows, const PatchWindow& window, const PatchPoint& at, PatchSums& sums) {
  switch (window.steps) {
    case 2:
      return sum_steps<2, L>(rows, window, at, sums);
    default:
      return sum_steps<4, L>(rows, window, at, sums);
  }
}

}  // namespace sums
}  // namespace waymark::refinement
