#include "waymark/tags/pattern_sums.hpp"

#include "waymark/tags/lanes.hpp"

namespace waymark::refinement {

void sum_patch_portable(const PatchRows& rows, const PatchWindow& window, const PatchPoint& at,
                        PatchSums& sums) {
  sums::sum_patch<Lanes>(rows, window, at, sums);
}

SumPatch quickest_sum_patch() {
#ifdef WAYMARK_AVX2
  static const bool kHasAvx2 = __builtin_cpu_supports("avx2") > 0 && __builtin_cpu_supports("fma") > 0;
  if (kHasAvx2) return sum_patch_avx2;
#endif
  return sum_patch_portable;
}

}  // namespace waymark::refinement
