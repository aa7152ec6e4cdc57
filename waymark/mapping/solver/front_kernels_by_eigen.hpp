#pragma once

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "waymark/mapping/solver/front_kernels.hpp"

namespace waymark::internal {

/// FrontKernels by Eigen for the processor a file is compiled for; `For` tells them apart. A file that is
/// compiled for more than the rest of the program must give Eigen a name of its own (#define Eigen ...)
/// before it includes this: or else the linker may take its templates for everybody.
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

  // With a panel's columns [L; B] and W = B L^-1, Z what is known of the inverse behind it: to the left of
  // that -Z W, on the diagonal (L L^T)^-1 + W^T Z W. Z is kept symmetric to the last digit: a symmetric
  // error goes from front to front by [-W^T I], as what is known does, and stays small; one that is not would
  // meet its own mirror image and grow without bound.
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
