#pragma once

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "waymark/mapping/solver/front_kernels.hpp"

namespace waymark::internal {

/// FrontKernels implemented with Eigen, for the processor that the including file is compiled for. `For`
/// makes the types distinct. A file compiled for a larger instruction set than the rest of the program must
/// rename Eigen (#define Eigen ...) before it includes this header. Otherwise the linker may use the
/// templates compiled there throughout the program.
template <class For>
struct FrontKernelsByEigen {
  using Matrix = Eigen::MatrixXd;
  using Columns = Eigen::Map<Matrix>;
  using GivenColumns = Eigen::Map<const Matrix>;

  static bool eliminate(double* front, int size, int own) {
    Columns F(front, size, size);
    const int rows = size - own;
    Eigen::Ref<Matrix> A = F.topLeftCorner(own, own);
    const Eigen::LLT<Eigen::Ref<Matrix>> llt(A);
    if (llt.info() != Eigen::Success) return false;
    if (rows == 0) return true;
    auto B = F.bottomLeftCorner(rows, own);
    A.transpose().template triangularView<Eigen::Upper>().template solveInPlace<Eigen::OnTheRight>(B);
    F.bottomRightCorner(rows, rows).template selfadjointView<Eigen::Lower>().rankUpdate(B, -1);
    return true;
  }

  // Let [L; B] be the columns of a panel, W = B L^-1, and Z the known inverse of the part after the panel.
  // Then the inverse is -Z W to the left of Z, and (L L^T)^-1 + W^T Z W on the diagonal. Z is kept exactly
  // symmetric. A symmetric error propagates from front to front through [-W^T I], as Z does, and stays small.
  // An asymmetric error would be combined with its transpose and grow without bound.
  static void invert(const double* columns, int size, int own, double* inverse) {
    constexpr int kPanel = 128;
    const GivenColumns factor(columns, size, own);
    Columns Z(inverse, size, size);
    Matrix W;
    Matrix L_inverse;
    for (int end = own; end > 0;) {
      const int begin = (end - 1) / kPanel * kPanel;
      const int width = end - begin;
      const int behind = size - end;
      const auto L = factor.block(begin, begin, width, width).template triangularView<Eigen::Lower>();
      auto on_diagonal = Z.block(begin, begin, width, width);
      L_inverse.setIdentity(width, width);
      L.solveInPlace(L_inverse);
      on_diagonal.noalias() = L_inverse.transpose() * L_inverse;
      if (behind > 0) {
        W = factor.block(end, begin, behind, width);
        L.template solveInPlace<Eigen::OnTheRight>(W);
        auto below = Z.block(end, begin, behind, width);
        below.noalias() = -Z.bottomRightCorner(behind, behind) * W;
        on_diagonal.noalias() -= W.transpose() * below;
        Z.block(begin, end, width, behind) = below.transpose();
      }
      for (int c = 1; c < width; ++c) on_diagonal.col(c).head(c) = on_diagonal.row(c).head(c).transpose();
      end = begin;
    }
  }

  [[nodiscard]] static constexpr FrontKernels named(const char* name) { return {name, eliminate, invert}; }
};

}  // namespace waymark::internal
