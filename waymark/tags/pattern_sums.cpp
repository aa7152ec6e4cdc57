#include "waymark/tags/pattern_sums.hpp"

#include "waymark/tags/lanes.hpp"

namespace waymark::refinement {

PatternSums sum_pattern_portable(const PatternRows& rows, const PatternPoint& at, bool with_information,
                                 BlockSums* blocks) {
  return sums::sum_pattern<Lanes>(rows, at, with_information, blocks);
}

SumPattern quickest_sum_pattern() {
#ifdef WAYMARK_AVX2
  static const bool kHasAvx2 = __builtin_cpu_supports("avx2") > 0 && __builtin_cpu_supports("fma") > 0;
  if (kHasAvx2) return sum_pattern_avx2;
#endif
  return sum_pattern_portable;
}

}  // namespace waymark::refinement
