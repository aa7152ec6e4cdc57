#pragma once

#include <vector>

namespace waymark::internal {

/// What is done to the dense matrices of fronts, which is where the time of a large map goes; compiled for
/// several processors. Matrices are by columns, one after the other.
struct FrontKernels {
  const char* name;

  /// Cholesky's factor of the first `own` columns of a symmetric matrix of which the lower triangle is given;
  /// what they leave of the rest takes its place (lower triangle). False where it is not positive definite.
  /// O(own size^2).
  bool (*eliminate)(double* front, int size, int own);

  /// Given the factor's columns of a front (size x own) and the inverse in its last size - own rows and
  /// columns (both triangles), fills in the rest of the inverse, both triangles (Erisman and Tinney, "On
  /// computing certain elements of the inverse of a sparse matrix", CACM 18(3), 1975, by blocks of columns).
  /// Symmetric to the last digit. O(own size^2).
  void (*invert)(const double* columns, int size, int own, double* inverse);
};

/// Those this processor can run, the quickest last. They differ by rounding.
[[nodiscard]] const std::vector<const FrontKernels*>& front_kernels();

}  // namespace waymark::internal
