// For processors with AVX-512. Eigen's templates are compiled under another name: those of the same name and
// these would be one to the linker.
#define Eigen EigenForAvx512
#include "waymark/mapping/solver/front_kernels_by_eigen.hpp"

namespace waymark::internal {

extern const FrontKernels kAvx512FrontKernels;
constinit const FrontKernels kAvx512FrontKernels =
    FrontKernelsByEigen<struct Avx512Processor>::named("avx512");

}  // namespace waymark::internal
