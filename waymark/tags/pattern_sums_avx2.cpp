// Compiled with AVX2 and FMA (CMakeLists.txt), and called only on processors that have them.
#include "waymark/tags/avx2_lanes.hpp"
#include "waymark/tags/pattern_sums.hpp"

namespace waymark::refinement {

PatternSums sum_pattern_avx2(const PatternRows& rows, const PatternPoint& at, bool with_information,
                             BlockSums* blocks) {
  return sums::sum_pattern<Avx2Lanes>(rows, at, with_information, blocks);
}

}  // namespace waymark::refinement
