#include "waymark/mapping/solver/front_kernels.hpp"

#include "waymark/mapping/solver/front_kernels_by_eigen.hpp"

namespace waymark::internal {

#ifdef WAYMARK_AVX2
extern const FrontKernels kAvx2FrontKernels;
extern const FrontKernels kAvx512FrontKernels;
#endif

const std::vector<const FrontKernels*>& front_kernels() {
  static constexpr FrontKernels kPortable = FrontKernelsByEigen<struct AnyProcessor>::named("portable");
  static const std::vector<const FrontKernels*> kAll = [] {
    std::vector<const FrontKernels*> all{&kPortable};
#ifdef WAYMARK_AVX2
    const bool has_avx2 = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
    if (has_avx2) all.push_back(&kAvx2FrontKernels);
    if (has_avx2 && __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0)
      all.push_back(&kAvx512FrontKernels);
#endif
    return all;
  }();
  return kAll;
}

}  // namespace waymark::internal
