#include "waymark/mapping/selected_inverse.hpp"

#include <algorithm>

namespace waymark::internal {

// With P A P^T = L D L^T and Z its inverse: Z = D^-1 L^-1 + (I - L^T) Z (Takahashi et al.; Erisman and
// Tinney, "On computing certain elements of the inverse of a sparse matrix", CACM 18(3), 1975). For an entry
// below the diagonal the first term is 0, so column j of Z, from the last to the first, follows from columns
// to its right:
//   Z_ij = - sum_k L_kj Z_ik,  Z_jj = 1 / D_j - sum_k L_kj Z_kj,  over the entries k of column j of L.
// All Z_ik needed are in the pattern of L: its column j is a clique.
SelectedInverse::SelectedInverse(const BlockSystem::Cholesky& cholesky)
    : L_(cholesky.matrixL().nestedExpression()), permutation_(cholesky.permutationP().indices()) {
  const Eigen::VectorXd D = cholesky.vectorD();
  const auto n = static_cast<int>(L_.cols());
  L_.makeCompressed();
  Z_.assign(static_cast<std::size_t>(L_.nonZeros()), 0.0);
  diagonal_.resize(n);
  const int* outer = L_.outerIndexPtr();
  const int* inner = L_.innerIndexPtr();
  const double* values = L_.valuePtr();
  std::vector<int> place(static_cast<std::size_t>(n), -1);  // of a row among the entries of column j
  std::vector<double> sum;
  for (int j = n - 1; j >= 0; --j) {
    const int begin = outer[j];
    const int count = outer[j + 1] - begin;
    for (int a = 0; a < count; ++a) place[static_cast<std::size_t>(inner[begin + a])] = a;
    sum.assign(static_cast<std::size_t>(count), 0.0);
    for (int a = 0; a < count; ++a) {
      const int k = inner[begin + a];
      const double L_kj = values[begin + a];
      sum[static_cast<std::size_t>(a)] += L_kj * diagonal_[k];
      for (int e = outer[k]; e < outer[k + 1]; ++e) {
        const int b = place[static_cast<std::size_t>(inner[e])];
        if (b < 0) continue;
        const double Z_ik = Z_[static_cast<std::size_t>(e)];
        sum[static_cast<std::size_t>(b)] += L_kj * Z_ik;
        sum[static_cast<std::size_t>(a)] += values[begin + b] * Z_ik;
      }
    }
    double own = 1 / D[j];
    for (int a = 0; a < count; ++a) {
      Z_[static_cast<std::size_t>(begin + a)] = -sum[static_cast<std::size_t>(a)];
      own += values[begin + a] * sum[static_cast<std::size_t>(a)];
      place[static_cast<std::size_t>(inner[begin + a])] = -1;
    }
    diagonal_[j] = own;
  }
}

double SelectedInverse::at(int row, int column) const {
  if (row == column) return diagonal_[row];
  const int low = std::min(row, column);
  const int high = std::max(row, column);
  const int* begin = L_.innerIndexPtr() + L_.outerIndexPtr()[low];
  const int* end = L_.innerIndexPtr() + L_.outerIndexPtr()[low + 1];
  const int* found = std::lower_bound(begin, end, high);
  if (found == end || *found != high) return 0;
  return Z_[static_cast<std::size_t>(found - L_.innerIndexPtr())];
}

Eigen::MatrixXd SelectedInverse::block(int first, int size) const {
  Eigen::MatrixXd block(size, size);
  for (int r = 0; r < size; ++r) {
    for (int c = 0; c <= r; ++c)
      block(r, c) = block(c, r) = at(permutation_[first + r], permutation_[first + c]);
  }
  return block;
}

}  // namespace waymark::internal
