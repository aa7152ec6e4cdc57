#include "waymark/tags/refinement/avx2_lanes.hpp"
#include "waymark/tags/refinement/inner_sums.hpp"

namespace waymark::refinement {

InnerKernels avx2_inner_kernels() { return inner::kernels<Avx2Lanes>(); }

}  // namespace waymark::refinement
