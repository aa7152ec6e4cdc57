// For processors with AVX-512. Eigen is renamed because otherwise the linker would merge these templates with
// others of the same name.
#define Eigen EigenForAvx512
#include "waymark/mapping/solver/front_kernels_by_eigen.hpp"

namespace waymark::internal {

extern const FrontKernels kAvx512FrontKernels;
constinit const FrontKernels kAvx512FrontKernels =
    FrontKernelsByEigen<struct Avx512Processor>::named("avx512");

}  // namespace waymark::internal
