#include "waymark/mapping/optimization/front_cholesky.hpp"

#include <algorithm>

#include <Eigen/Cholesky>

namespace waymark::internal {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// Where in a front its unknowns begin; a scratch by unknown.
void set_places(const FrontPlan::Front& front, std::vector<int>& place) {
  for (std::size_t k = 0; k < front.unknowns.size(); ++k) place[at(front.unknowns[k])] = front.offsets[k];
}

template <class Target, class Block>
void add_block(Target& F, int row, int column, const Block& block) {
  if (row >= column) {
    if (block.rows() == 6 && block.cols() == 6)
      F.template block<6, 6>(row, column) += block.template topLeftCorner<6, 6>();
    else
      F.block(row, column, block.rows(), block.cols()) += block;
  } else {
    F.block(column, row, block.cols(), block.rows()) += block.transpose();
  }
}

void make_symmetric(Eigen::Ref<Eigen::MatrixXd> A) {
  for (Eigen::Index c = 1; c < A.cols(); ++c) A.col(c).head(c) = A.row(c).head(c).transpose();
}

}  // namespace

FrontCholesky::FrontCholesky(const BlockSystem& system, const FrontPlan& plan)
    : system_(system), plan_(plan), blocks_(plan.fronts.size()), children_(plan.fronts.size()) {
  for (std::size_t u = 0; u < plan.front_of.size(); ++u) {
    const int column = static_cast<int>(u);
    system.for_column(column, [&](int row, const auto& /*block*/) {
      blocks_[at(std::min(plan.front_of[at(row)], plan.front_of[u]))].emplace_back(row, column);
    });
  }
  for (std::size_t f = 0; f < plan.fronts.size(); ++f) {
    if (plan.fronts[f].parent >= 0) children_[at(plan.fronts[f].parent)].push_back(f);
  }
}

void FrontCholesky::assemble(std::size_t front, double damping, double floor, const std::vector<int>& place,
                             Matrix& F) const {
  const FrontPlan::Front& shape = plan_.fronts[front];
  F.setZero(shape.size, shape.size);
  for (const auto& [row, column] : blocks_[front])
    add_block(F, place[at(row)], place[at(column)], *system_.block(row, column));
  auto diagonal = F.diagonal().head(shape.own_size);
  diagonal += damping * diagonal + Eigen::VectorXd::Constant(shape.own_size, floor);
}

void FrontCholesky::add_update(std::size_t child, const Matrix& update, const std::vector<int>& place,
                               Matrix& F) const {
  const FrontPlan::Front& shape = plan_.fronts[child];
  for (std::size_t c = at(shape.own); c < shape.unknowns.size(); ++c) {
    const int columns = system_.dimension(shape.unknowns[c]);
    const int from = shape.offsets[c] - shape.own_size;
    const int to = place[at(shape.unknowns[c])];
    F.block(to, to, columns, columns) += update.block(from, from, columns, columns);
    for (std::size_t r = c + 1; r < shape.unknowns.size(); ++r) {
      add_block(F, place[at(shape.unknowns[r])], to,
                update.block(shape.offsets[r] - shape.own_size, from, system_.dimension(shape.unknowns[r]),
                             columns));
    }
  }
}

bool FrontCholesky::factorize(double damping, double floor) {
  L_.resize(plan_.fronts.size());
  std::vector<int> place(plan_.front_of.size(), 0);
  std::vector<Matrix> updates(plan_.fronts.size());
  Matrix F;
  for (std::size_t f = 0; f < plan_.fronts.size(); ++f) {
    const FrontPlan::Front& shape = plan_.fronts[f];
    const int own = shape.own_size;
    const int rows = shape.size - own;
    set_places(shape, place);
    assemble(f, damping, floor, place, F);
    for (std::size_t child : children_[f]) {
      add_update(child, updates[child], place, F);
      updates[child].resize(0, 0);
    }
    Eigen::Ref<Matrix> A = F.topLeftCorner(own, own);
    const Eigen::LLT<Eigen::Ref<Matrix>> llt(A);
    if (llt.info() != Eigen::Success) return false;
    if (rows > 0) {
      auto B = F.bottomLeftCorner(rows, own);
      A.transpose().triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(B);
      auto C = F.bottomRightCorner(rows, rows);
      C.selfadjointView<Eigen::Lower>().rankUpdate(B, -1);
      updates[f] = C;
    }
    L_[f] = F.leftCols(own);
  }
  return true;
}

Eigen::VectorXd FrontCholesky::solve(const Eigen::VectorXd& rhs) const {
  Eigen::VectorXd x = rhs;
  Eigen::VectorXd part;
  const auto move = [&](const FrontPlan::Front& shape, std::size_t from, std::size_t to, bool back) {
    for (std::size_t k = from; k < to; ++k) {
      const int unknown = shape.unknowns[k];
      auto in_x = x.segment(system_.offset(unknown), system_.dimension(unknown));
      auto in_part = part.segment(shape.offsets[k], system_.dimension(unknown));
      if (back)
        in_x = in_part;
      else
        in_part = in_x;
    }
  };
  for (std::size_t f = 0; f < plan_.fronts.size(); ++f) {
    const FrontPlan::Front& shape = plan_.fronts[f];
    part.resize(shape.size);
    move(shape, 0, shape.unknowns.size(), false);
    const auto L = L_[f].topRows(shape.own_size).triangularView<Eigen::Lower>();
    L.solveInPlace(part.head(shape.own_size));
    part.tail(shape.size - shape.own_size).noalias() -=
        L_[f].bottomRows(shape.size - shape.own_size) * part.head(shape.own_size);
    move(shape, 0, shape.unknowns.size(), true);
  }
  for (std::size_t f = plan_.fronts.size(); f-- > 0;) {
    const FrontPlan::Front& shape = plan_.fronts[f];
    part.resize(shape.size);
    move(shape, 0, shape.unknowns.size(), false);
    part.head(shape.own_size).noalias() -=
        L_[f].bottomRows(shape.size - shape.own_size).transpose() * part.tail(shape.size - shape.own_size);
    L_[f]
        .topRows(shape.own_size)
        .transpose()
        .triangularView<Eigen::Upper>()
        .solveInPlace(part.head(shape.own_size));
    move(shape, 0, at(shape.own), true);
  }
  return x;
}

// With the front's columns [L; B] and W = B L^-1: Z_rows,own = -Z_rows W, Z_own = (L L^T)^-1 + W^T Z_rows W.
// Z is kept symmetric to the last digit: a symmetric error goes from front to front by [-W^T I], as what is
// known does, and stays small; one that is not would meet its own mirror image and grow without bound.
FrontCholesky::Matrix FrontCholesky::inverse_of_front(std::size_t front, const Matrix& of_rows) const {
  const FrontPlan::Front& shape = plan_.fronts[front];
  const int own = shape.own_size;
  const int rows = shape.size - own;
  const auto L = L_[front].topRows(own).triangularView<Eigen::Lower>();
  Matrix Z(shape.size, shape.size);
  Matrix L_inverse = Matrix::Identity(own, own);
  L.solveInPlace(L_inverse);
  Z.topLeftCorner(own, own).noalias() = L_inverse.transpose() * L_inverse;
  make_symmetric(Z.topLeftCorner(own, own));
  if (rows == 0) return Z;
  Matrix W = L_[front].bottomRows(rows);
  L.solveInPlace<Eigen::OnTheRight>(W);
  Z.bottomRightCorner(rows, rows) = of_rows;
  Z.bottomLeftCorner(rows, own).noalias() = -of_rows * W;
  Z.topRightCorner(own, rows) = Z.bottomLeftCorner(rows, own).transpose();
  Z.topLeftCorner(own, own).noalias() -= W.transpose() * Z.bottomLeftCorner(rows, own);
  make_symmetric(Z.topLeftCorner(own, own));
  return Z;
}

std::vector<Eigen::MatrixXd> FrontCholesky::inverse_blocks(
    std::span<const std::pair<int, int>> wanted) const {
  std::vector<std::vector<std::size_t>> wanted_of(plan_.fronts.size());
  for (std::size_t i = 0; i < wanted.size(); ++i)
    wanted_of[at(std::min(plan_.front_of[at(wanted[i].first)], plan_.front_of[at(wanted[i].second)]))]
        .push_back(i);
  std::vector<Matrix> result(wanted.size());
  std::vector<Matrix> Z(plan_.fronts.size());
  std::vector<int> place(plan_.front_of.size(), 0);
  Matrix of_rows;
  for (std::size_t f = plan_.fronts.size(); f-- > 0;) {
    const FrontPlan::Front& shape = plan_.fronts[f];
    if (shape.parent >= 0) {
      set_places(plan_.fronts[at(shape.parent)], place);
      const Matrix& above = Z[at(shape.parent)];
      of_rows.resize(shape.size - shape.own_size, shape.size - shape.own_size);
      for (std::size_t c = at(shape.own); c < shape.unknowns.size(); ++c) {
        for (std::size_t r = at(shape.own); r < shape.unknowns.size(); ++r) {
          const int rows = system_.dimension(shape.unknowns[r]);
          const int columns = system_.dimension(shape.unknowns[c]);
          of_rows.block(shape.offsets[r] - shape.own_size, shape.offsets[c] - shape.own_size, rows, columns) =
              above.block(place[at(shape.unknowns[r])], place[at(shape.unknowns[c])], rows, columns);
        }
      }
      if (shape.first_child) Z[at(shape.parent)].resize(0, 0);
    }
    Z[f] = inverse_of_front(f, of_rows);
    set_places(shape, place);
    for (std::size_t i : wanted_of[f]) {
      const auto& [row, column] = wanted[i];
      result[i] =
          Z[f].block(place[at(row)], place[at(column)], system_.dimension(row), system_.dimension(column));
    }
    if (children_[f].empty()) Z[f].resize(0, 0);
  }
  return result;
}

std::optional<Eigen::VectorXd> damped_step(FrontCholesky& cholesky, const BlockSystem& system,
                                           double damping) {
  constexpr double kStays = 1e-12;  // what nothing determines stays where it is
  if (!cholesky.factorize(damping, kStays)) return std::nullopt;
  Eigen::VectorXd step = cholesky.solve(-system.gradient());
  if (!step.allFinite()) return std::nullopt;
  return step;
}

}  // namespace waymark::internal
