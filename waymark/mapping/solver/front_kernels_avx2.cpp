// For processors with AVX2. Eigen is renamed because otherwise the linker would merge these templates with
// others of the same name.
#define Eigen EigenForAvx2
#include "waymark/mapping/solver/front_kernels_by_eigen.hpp"

namespace waymark::internal {

extern const FrontKernels kAvx2FrontKernels;
constinit const FrontKernels kAvx2FrontKernels = FrontKernelsByEigen<struct Avx2Processor>::named("avx2");

}  // namespace waymark::internal
