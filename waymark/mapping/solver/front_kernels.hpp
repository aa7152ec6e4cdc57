#pragma once

#include <vector>

namespace waymark::internal {

/// Operations on the dense matrices of fronts, which take up most of the time for a large map. They are
/// compiled for several types of processors. Matrices are column-major.
struct FrontKernels {
  const char* name;

  /// Factorises the first `own` columns of a symmetric matrix given by its lower triangle. These columns are
  /// replaced with those of the Cholesky factor, and the rest of the lower triangle with the Schur
  /// complement. Returns false if the matrix is not positive definite. O(own size^2).
  bool (*eliminate)(double* front, int size, int own);

  /// Computes the inverse for a front from its columns of the factor (size x own). The last size - own rows
  /// and columns of `inverse` must be given; the rest is filled in. Both triangles are stored (Erisman and
  /// Tinney, "On computing certain elements of the inverse of a sparse matrix", CACM 18(3), 1975, applied to
  /// blocks of columns). The result is exactly symmetric. O(own size^2).
  void (*invert)(const double* columns, int size, int own, double* inverse);
};

/// The kernels that this processor supports, with the fastest last. Their results differ by rounding.
[[nodiscard]] const std::vector<const FrontKernels*>& front_kernels();

}  // namespace waymark::internal
