#include "waymark/tags/avx2_lanes.hpp"
#include "waymark/tags/pattern_sums.hpp"

namespace waymark::refinement {

void sum_patch_avx2(const PatchRows& rows, const PatchWindow& window, const PatchPoint& at, PatchSums& sums) {
  sums::sum_patch<Avx2Lanes>(rows, window, at, sums);
}

}  // namespace waymark::refinement
