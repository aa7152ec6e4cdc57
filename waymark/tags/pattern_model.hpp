#pragma once

// How the pixels of a tag look and how that moves with its parameters, written once for every type of lanes
// (lane_math.hpp). No Eigen here.
#include <cstddef>

#include "waymark/tags/lane_math.hpp"

namespace waymark::refinement {

/// Parameters of the picture of one tag. A place of the tag is t = (t_u, t_v), from -1 to 1 over the border
/// square; x and y are those of TagPixels.
enum TagParameter : int {
  kHomography = 0,  ///< 8: the homography from t to x, y by rows, its last entry 1
  kBlackPlane = 8,  ///< 3: [grey level] at the middle, change to the border along u and along v
  kStepPlane = 11,  ///< 3: the same of white less black
  kGrowth = 14,     ///< ln of (1 + growth): shares f of white become f (1 + growth) / (1 + growth f)
  kLogBlur = 15,    ///< ln of the blur's standard deviation [px]
  kStretch = 16,    ///< 2: blur covariance is blur^2 [1 + e1, e2; e2, 1 - e1]
  kHalo = 18,       ///< excess kurtosis of the blur along a line, over 24
  kLens = 19,       ///< 4: bends of straight lines, see LensBends
  kShared = 23,     ///< parameters that act on all pixels
  kRim = kShared,   ///< 4: step from white to what lies beyond the margin, as a share, at each side
  kTagParameters = 27
};

/// Grey levels at or beyond these are what the sensor could not show.
inline constexpr float kDarkest = 1.0F;
inline constexpr float kBrightest = 253.0F;

/// Pixels next to each other that are looked at together: a lane of one block.
inline constexpr int kClusterPixels = 8;
inline constexpr int kBlockPixels = kClusterPixels * kLanes;

/// Where the model is developed.
struct PatternPoint {
  float tag_H_x[9];  ///< inverse of the homography
  float half_cells;  ///< cells along half the border square
  float blur_x2[3];  ///< covariance of the blur in x and y: xx, xy, yy
  float round_x2;    ///< blur^2 in x and y
  float halo;        ///< kHalo
  float black[3], step[3];
  float growth;
  /// LensBends: a place q = (x, y) is moved by lens[0] q^2 r + lens[1] q^2 t + lens[2] (q r)^2 r + lens[3]
  /// q^2 q, with r the unit vector `radial` and t the one a right angle further.
  float lens[4];
  float radial[2];
};

/// A pattern of cells around a pixel is white in the share
///   c + sum_a p_a F(u - a) + sum_b q_b F(v - b) + sum_ab r_ab F(u - a) F(v - b),
/// with a and b the `steps` lines of cells from first_u and first_v on, F the blurred step.
[[nodiscard]] constexpr std::size_t shares_of(std::size_t steps) { return 1 + 2 * steps + steps * steps; }
inline constexpr std::size_t kMostSteps = 4;

/// Pixels of a tag as kClusterPixels rows of kLanes: a lane is a cluster.
struct PixelBlock {
  using Rows = float[kBlockPixels];
  Rows x, y, value, weight;           ///< of weight 0: no pixel
  Rows first_u, first_v;              ///< [cell] the first lines of cells that matter to a pixel
  Rows share[shares_of(kMostSteps)];  ///< c, p, q, r by rows of b; with few steps only the first of them
  /// By clusters: what lies beyond the margin begins where rim_u u + rim_v v + rim_1 is 0 [cell] and grows;
  /// all 0 where it is too far to matter.
  float rim_u[kLanes], rim_v[kLanes], rim_1[kLanes];
  float rim_level[kLanes];       ///< kRim of that side
  float cluster_weight[kLanes];  ///< 0 to 1
  int side[kLanes];              ///< whose kRim matters (0 top, 1 right, 2 bottom, 3 left), or -1
  bool rim_matters;              ///< in any cluster
};

namespace sums {

/// A blurred step at each line of cells and its derivatives by the place [cell], by ln of the blur and by
/// kHalo: (1 + halo) times a Gaussian's, less halo times that of a wider bell (bell_cdf()).
template <std::size_t kSteps, class L>
struct Steps {
  L cdf[kSteps], pdf[kSteps], bend[kSteps], halo[kSteps];
  [[gnu::always_inline]] Steps(const L& from_first, const L& inverse_blur, float strength) {
    constexpr float kWider = 1.8F;
    constexpr float kReach = 3.6055513F * kWider;  // of the bell
    for (std::size_t a = 0; a < kSteps; ++a) {
      const L z = (from_first - static_cast<float>(a)) * inverse_blur;
      const NormalLanes<L> normal = normal_lanes<L>(z);
      const L y = ((1.0F / kReach) * z).max(-1.0F).min(1.0F);
      const L y2 = y * y;
      const L wide = 0.5F + y * bell_cdf_series<L>(y2);
      const L left = 1.0F - y2;
      const L left2 = left * left;
      const L wide_pdf = (1.35351563F / kReach) * (left2 * left2 * left);
      halo[a] = normal.cdf - wide;
      cdf[a] = normal.cdf + strength * halo[a];
      const L density = normal.pdf + strength * (normal.pdf - wide_pdf);
      pdf[a] = density * inverse_blur;
      bend[a] = -(z * density);
    }
  }
};

/// Share of white in the blurred pattern and its derivatives.
template <class L>
struct Share {
  L f, by_u, by_v, by_blur_u, by_blur_v, by_blur_uv, by_halo, by_rim;
};

template <std::size_t kSteps, class L>
[[gnu::always_inline]] inline Share<L> share_of_white(const PixelBlock& block, std::size_t row,
                                                      const Steps<kSteps, L>& along,
                                                      const Steps<kSteps, L>& across, const L& blur_uv) {
  std::size_t at = 0;
  const auto next = [&] { return load<L>(block.share[at++] + row); };
  Share<L> s{next(), L::Zero(), L::Zero(), L::Zero(), L::Zero(), L::Zero(), L::Zero(), L::Zero()};
  L by_along[kSteps];
  for (std::size_t a = 0; a < kSteps; ++a) by_along[a] = next();
  L by_across[kSteps];
  for (std::size_t b = 0; b < kSteps; ++b) {
    by_across[b] = next();
    s.f += by_across[b] * across.cdf[b];
  }
  for (std::size_t b = 0; b < kSteps; ++b) {
    for (std::size_t a = 0; a < kSteps; ++a) {
      const L both = next();
      by_along[a] += both * across.cdf[b];
      by_across[b] += both * along.cdf[a];
      s.by_blur_uv += both * along.pdf[a] * across.pdf[b];
    }
  }
  for (std::size_t a = 0; a < kSteps; ++a) {
    s.f += by_along[a] * along.cdf[a];
    s.by_u += by_along[a] * along.pdf[a];
    s.by_v += by_across[a] * across.pdf[a];
    s.by_blur_u += by_along[a] * along.bend[a];
    s.by_blur_v += by_across[a] * across.bend[a];
    s.by_halo += by_along[a] * along.halo[a] + by_across[a] * across.halo[a];
  }
  // Where the blur is not along u and v: the first term of the tetrachoric series of the normal distribution
  // of two variables (Pearson, "On the correlation of characters not quantitatively measurable", Phil. Trans.
  // A 195, 1900).
  s.f += blur_uv * s.by_blur_uv;
  return s;
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

/// What lies beyond the margin, for the clusters of one block.
template <class L>
struct Rim {
  L u, v, one, level;
};

template <class L>
[[gnu::always_inline]] inline void add_rim(const Rim<L>& rim, const L& u, const L& v, const L& inverse_blur_u,
                                           const L& inverse_blur_v, Share<L>& s) {
  const L inverse_blur = rim.u.abs() * inverse_blur_u + rim.v.abs() * inverse_blur_v;
  const L z = (rim.u * u + rim.v * v + rim.one) * inverse_blur;
  const NormalLanes<L> normal = normal_lanes<L>(z);
  const L near = positive<L>(inverse_blur);
  const L slope = rim.level * (inverse_blur * normal.pdf);
  const L bend = -(rim.level * (z * normal.pdf));
  s.by_rim = near * normal.cdf;
  s.f += rim.level * s.by_rim;
  s.by_u += slope * rim.u;
  s.by_v += slope * rim.v;
  s.by_blur_u += bend * rim.u.abs();
  s.by_blur_v += bend * rim.v.abs();
}

/// One row of pixels: how the model moves with each parameter, and what is left.
template <class L>
struct RowModel {
  L by[kShared + 1];
  L residual, weight;
};

template <std::size_t kSteps, bool kRimMatters, class L>
[[gnu::always_inline]] inline void row_model(const PixelBlock& pixels, bool clipped, std::size_t row,
                                             const PatternPoint& at, const Rim<L>& rim, RowModel<L>& m) {
  const float* G = at.tag_H_x;
  L x = load<L>(pixels.x + row);
  L y = load<L>(pixels.y + row);
  const L q2 = x * x + y * y;
  const L along_radial = at.radial[0] * x + at.radial[1] * y;
  const L radial2 = along_radial * along_radial;
  const L by_radius = at.lens[0] * q2 + at.lens[2] * radial2;
  const L by_turn = at.lens[1] * q2;
  const L by_growth = at.lens[3] * q2;
  const L qx = x;
  const L qy = y;
  x += by_radius * at.radial[0] - by_turn * at.radial[1] + by_growth * qx;
  y += by_radius * at.radial[1] + by_turn * at.radial[0] + by_growth * qy;
  const L inverse_w = G[6] * x + G[7] * y + G[8];  // 1 / w of the homography
  const L w = inverse_w.max(1e-3F).inverse();
  const L tu = (G[0] * x + G[1] * y + G[2]) * w;
  const L tv = (G[3] * x + G[4] * y + G[5]) * w;
  // Derivatives of cells by x and y.
  const L scale = at.half_cells * w;
  const L ux = scale * (G[0] - tu * G[6]);
  const L uy = scale * (G[1] - tu * G[7]);
  const L vx = scale * (G[3] - tv * G[6]);
  const L vy = scale * (G[4] - tv * G[7]);
  const float sxx = at.blur_x2[0];
  const float sxy = at.blur_x2[1];
  const float syy = at.blur_x2[2];
  const L blur_uu = (sxx * ux * ux + (2.0F * sxy) * ux * uy + syy * uy * uy).max(1e-6F);
  const L blur_vv = (sxx * vx * vx + (2.0F * sxy) * vx * vy + syy * vy * vy).max(1e-6F);
  const L blur_uv = sxx * ux * vx + sxy * (ux * vy + uy * vx) + syy * uy * vy;
  const L inverse_blur_u = blur_uu.rsqrt();
  const L inverse_blur_v = blur_vv.rsqrt();
  const L u = at.half_cells * (tu + 1.0F);
  const L v = at.half_cells * (tv + 1.0F);
  const Steps<kSteps, L> along(u - load<L>(pixels.first_u + row), inverse_blur_u, at.halo);
  const Steps<kSteps, L> across(v - load<L>(pixels.first_v + row), inverse_blur_v, at.halo);
  Share<L> s = share_of_white<kSteps, L>(pixels, row, along, across, blur_uv);
  if constexpr (kRimMatters) add_rim<L>(rim, u, v, inverse_blur_u, inverse_blur_v, s);
  const L f = s.f.max(-0.3F).min(1.5F);
  const L bent = (1.0F + at.growth * f).max(0.2F).inverse();
  const L white = f * bent * (1.0F + at.growth);
  const L step = at.step[0] + at.step[1] * tu + at.step[2] * tv;
  const L predicted = at.black[0] + at.black[1] * tu + at.black[2] * tv + step * white;
  const L value = load<L>(pixels.value + row);
  m.weight = load<L>(pixels.weight + row);
  if (clipped) m.weight *= within_scale<L>(value, predicted);
  m.residual = value - predicted;
  const L slope = step * bent * bent * (1.0F + at.growth);
  const L by_u = slope * s.by_u;
  const L by_v = slope * s.by_v;
  const L by_x = by_u * ux + by_v * vx;
  const L by_y = by_u * uy + by_v * vy;
  const L moved_x = -(by_x * inverse_w);
  const L moved_y = -(by_y * inverse_w);
  const L turned = -(moved_x * x + moved_y * y);
  m.by[0] = moved_x * tu;
  m.by[1] = moved_x * tv;
  m.by[2] = moved_x;
  m.by[3] = moved_y * tu;
  m.by[4] = moved_y * tv;
  m.by[5] = moved_y;
  m.by[6] = turned * tu;
  m.by[7] = turned * tv;
  m.by[kBlackPlane] = L::Constant(1.0F);
  m.by[kBlackPlane + 1] = tu;
  m.by[kBlackPlane + 2] = tv;
  m.by[kStepPlane] = white;
  m.by[kStepPlane + 1] = white * tu;
  m.by[kStepPlane + 2] = white * tv;
  m.by[kGrowth] = slope * f * (1.0F - f);
  const L uv = slope * s.by_blur_uv;
  const L blur_u = slope * s.by_blur_u;
  const L blur_v = slope * s.by_blur_v;
  const L share_u = at.round_x2 * inverse_blur_u * inverse_blur_u * blur_u;
  const L share_v = at.round_x2 * inverse_blur_v * inverse_blur_v * blur_v;
  m.by[kLogBlur] = blur_u + blur_v + 2.0F * blur_uv * uv;
  m.by[kStretch] = 0.5F * (share_u * (ux * ux - uy * uy) + share_v * (vx * vx - vy * vy)) +
                   at.round_x2 * uv * (ux * vx - uy * vy);
  m.by[kStretch + 1] = share_u * ux * uy + share_v * vx * vy + at.round_x2 * uv * (ux * vy + uy * vx);
  m.by[kHalo] = slope * s.by_halo;
  const L radial = by_x * at.radial[0] + by_y * at.radial[1];
  m.by[kLens] = q2 * radial;
  m.by[kLens + 1] = q2 * (by_y * at.radial[0] - by_x * at.radial[1]);
  m.by[kLens + 2] = radial2 * radial;
  m.by[kLens + 3] = q2 * (by_x * qx + by_y * qy);
  m.by[kShared] = slope * s.by_rim;
}

}  // namespace sums
}  // namespace waymark::refinement
