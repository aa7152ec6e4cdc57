// Compiled with AVX2 and FMA (CMakeLists.txt), and called only on processors that have them.
#include "waymark/tags/avx2_lanes.hpp"
#include "waymark/tags/edge_sums.hpp"

namespace waymark::refinement {

EdgeSums sum_edge_avx2(const BandRows& band, const EdgePoint& x, float* costs) {
  return sums::sum_edge<Avx2Lanes>(band, x, costs);
}

}  // namespace waymark::refinement
