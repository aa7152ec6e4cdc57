#include "waymark/tags/refinement/avx2_lanes.hpp"
#include "waymark/tags/refinement/edge_sums.hpp"

namespace waymark::refinement {

EdgeSums sum_edge_avx2(const BandRows& band, const EdgePoint& x, float* costs) {
  return sums::sum_edge<Avx2Lanes>(band, x, costs);
}

}  // namespace waymark::refinement
