#pragma once

#include <vector>

namespace waymark::internal {

/// Operations on the dense matrices of fronts, which take most of the time on a large map. They are compiled
/// for several processors. Matrices are column-major.
struct FrontKernels {
  const char* name;

  /// Cholesky factor of the first `own` columns of a symmetric matrix given by its lower triangle. The Schur
  /// complement replaces the rest (lower triangle). False if the matrix is not positive definite. O(own
  /// size^2).
  bool (*eliminate)(double* front, int size, int own);

  /// Computes the inverse from the factor's columns of a front (size x own). Initially the last size - own
  /// rows and columns of `inverse` are known; the rest is filled in. Both triangles are stored (Erisman and
  /// Tinney, "On computing certain elements of the inverse of a sparse matrix", CACM 18(3), 1975, by blocks
  /// of columns). The result is exactly symmetric. O(own size^2).
  void (*invert)(const double* columns, int size, int own, double* inverse);
};

/// Kernels that this processor supports, the fastest last. Their results differ by rounding.
[[nodiscard]] const std::vector<const FrontKernels*>& front_kernels();

}  // namespace waymark::internal
