#include "waymark/tags/edge_model.hpp"

#include <cmath>
#include <cstddef>

namespace waymark::refinement {
namespace {

EdgePoint edge_point(const EdgeVector& x, double light) {
  const auto inverse_blur = static_cast<float>(std::exp(-x[kLogBlur]));
  const auto step = static_cast<float>(x[kStep]);
  return {.from = static_cast<float>(x[kFrom]),
          .to = static_cast<float>(x[kTo]),
          .bend = static_cast<float>(x[kBend]),
          .beyond = static_cast<float>(x[kBeyond]),
          .inner = static_cast<float>(x[kInnerLevel]),
          .step = step,
          .inverse_blur = inverse_blur,
          .light = static_cast<float>(light),
          // As flat as a blurred edge is two standard deviations away from it.
          .flat_shift = 0.054F * std::abs(step) * inverse_blur};
}

BandRows band_rows(const Band& band) {
  return {.blocks = band.blocks,
          .depth = band.depth,
          .max_depth = kMaxDepth,
          .step_px = band.step_px,
          .cells_matter = band.cells_matter,
          .beyond_known = band.beyond_known,
          .clipped = band.clipped,
          .along = band.along[0].data(),
          .first_px = band.first_px[0].data(),
          .behind_px = band.behind_px[0].data(),
          .beyond_px = band.beyond_px[0].data(),
          .value = band.value[0][0].data(),
          .weight = band.weight[0][0].data(),
          .behind = band.behind[0][0].data(),
          .beyond = band.beyond[0][0].data(),
          .inside = band.inside[0][0].data()};
}

}  // namespace

EdgeSums sum_edge_portable(const BandRows& band, const EdgePoint& x, float* costs) {
  return sums::sum_edge<Lanes>(band, x, costs);
}

SumEdge quickest_sum_edge() {
#ifdef WAYMARK_AVX2
  static const bool kHasAvx2 = __builtin_cpu_supports("avx2") > 0 && __builtin_cpu_supports("fma") > 0;
  if (kHasAvx2) return sum_edge_avx2;
#endif
  return sum_edge_portable;
}

NormalEquations linearize(const Band& band, const EdgeVector& parameters, double light, SliceCosts& costs,
                          SumEdge sum_edge) {
  const EdgeSums sums = sum_edge(band_rows(band), edge_point(parameters, light), costs[0].data());
  NormalEquations normal;
  for (int i = 0; i < kParameters; ++i) {
    for (int k = i; k < kParameters; ++k) {
      normal.information(i, k) = static_cast<double>(sums.information[i][k]);
      normal.information(k, i) = normal.information(i, k);
    }
    normal.gradient[i] = static_cast<double>(sums.gradient[i]);
  }
  normal.cost = static_cast<double>(sums.cost);
  normal.flat_cost = static_cast<double>(sums.flat_cost);
  normal.flat_pixels = static_cast<double>(sums.flat_pixels);
  normal.light_information = static_cast<double>(sums.light_information);
  normal.light_gradient = static_cast<double>(sums.light_gradient);
  return normal;
}

}  // namespace waymark::refinement
