#include "waymark/mapping/optimization/schur_system.hpp"

#include <algorithm>
#include <numeric>

namespace waymark::internal {
namespace {

constexpr int kLargestGroup = 60;  // scalars
constexpr int kLargestReduced = 1500;

/// Groups as they grow: a forest of unknowns.
class Forest {
 public:
  explicit Forest(const std::vector<int>& dimensions) : parent_(dimensions.size()), size_(dimensions) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int root(int i) {
    while (parent_[static_cast<std::size_t>(i)] != i) {
      int& parent = parent_[static_cast<std::size_t>(i)];
      parent = parent_[static_cast<std::size_t>(parent)];
      i = parent;
    }
    return i;
  }
  [[nodiscard]] int size(int root) const { return size_[static_cast<std::size_t>(root)]; }
  void join(int a, int b) {
    a = root(a);
    b = root(b);
    if (a == b) return;
    parent_[static_cast<std::size_t>(a)] = b;
    size_[static_cast<std::size_t>(b)] += size_[static_cast<std::size_t>(a)];
  }

 private:
  std::vector<int> parent_;
  std::vector<int> size_;
};

using Neighbours = std::vector<std::vector<int>>;

Neighbours neighbours_of(std::size_t unknowns, const std::vector<std::pair<int, int>>& couplings) {
  Neighbours neighbours(unknowns);
  for (const auto& [a, b] : couplings) {
    if (a == b) continue;
    neighbours[static_cast<std::size_t>(a)].push_back(b);
    neighbours[static_cast<std::size_t>(b)].push_back(a);
  }
  for (auto& list : neighbours) {
    std::ranges::sort(list);
    list.erase(std::ranges::unique(list).begin(), list.end());
  }
  return neighbours;
}

/// Which unknowns are eliminated: those of few couplings first, as long as their group stays small.
std::vector<char> choose(const std::vector<int>& dimensions, const Neighbours& neighbours, Forest& forest) {
  std::vector<int> order(dimensions.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](int i) { return neighbours[static_cast<std::size_t>(i)].size(); });
  std::vector<char> eliminated(dimensions.size(), 0);
  std::vector<int> roots;
  for (int i : order) {
    roots.clear();
    for (int n : neighbours[static_cast<std::size_t>(i)]) {
      if (eliminated[static_cast<std::size_t>(n)] != 0) roots.push_back(forest.root(n));
    }
    std::ranges::sort(roots);
    roots.erase(std::ranges::unique(roots).begin(), roots.end());
    int size = dimensions[static_cast<std::size_t>(i)];
    for (int root : roots) size += forest.size(root);
    if (size > kLargestGroup) continue;
    eliminated[static_cast<std::size_t>(i)] = 1;
    for (int root : roots) forest.join(root, i);
  }
  return eliminated;
}

/// S -= W^T W of a group that is one pose among poses: blocks of 6x6, lower triangle only.
void subtract_pose(const SchurPlan& plan, const SchurPlan::Group& group, const Eigen::MatrixXd& W,
                   Eigen::MatrixXd& S) {
  for (std::size_t r = 0; r < group.kept.size(); ++r) {
    const Eigen::Matrix<double, 6, 6> row = W.block<6, 6>(0, 6 * static_cast<int>(r)).transpose();
    const int at = plan.place[static_cast<std::size_t>(group.kept[r])];
    for (std::size_t c = 0; c <= r; ++c) {
      S.block<6, 6>(at, plan.place[static_cast<std::size_t>(group.kept[c])]) -=
          row.lazyProduct(W.block<6, 6>(0, 6 * static_cast<int>(c)));
    }
  }
}

}  // namespace

bool SchurPlan::worth_it() const { return !groups.empty() && reduced <= kLargestReduced; }

SchurPlan schur_plan(const std::vector<int>& dimensions, const std::vector<std::pair<int, int>>& couplings) {
  const Neighbours neighbours = neighbours_of(dimensions.size(), couplings);
  Forest forest(dimensions);
  const std::vector<char> eliminated = choose(dimensions, neighbours, forest);
  SchurPlan plan{.group_of = std::vector<int>(dimensions.size(), -1),
                 .place = std::vector<int>(dimensions.size(), 0)};
  std::vector<int> group_at(dimensions.size(), -1);
  for (std::size_t i = 0; i < dimensions.size(); ++i) {
    const int unknown = static_cast<int>(i);
    if (eliminated[i] == 0) {
      plan.place[i] = plan.reduced;
      plan.reduced += dimensions[i];
      continue;
    }
    int& at = group_at[static_cast<std::size_t>(forest.root(unknown))];
    if (at < 0) {
      at = static_cast<int>(plan.groups.size());
      plan.groups.emplace_back();
    }
    SchurPlan::Group& group = plan.groups[static_cast<std::size_t>(at)];
    plan.group_of[i] = at;
    plan.place[i] = group.size;
    group.members.push_back(unknown);
    group.size += dimensions[i];
    for (int n : neighbours[i]) {
      if (eliminated[static_cast<std::size_t>(n)] == 0) group.kept.push_back(n);
    }
  }
  for (SchurPlan::Group& group : plan.groups) {
    std::ranges::sort(group.kept);
    group.kept.erase(std::ranges::unique(group.kept).begin(), group.kept.end());
    for (int k : group.kept) group.kept_size += dimensions[static_cast<std::size_t>(k)];
  }
  return plan;
}

SchurSystem::SchurSystem(const BlockSystem& system, const SchurPlan& plan) : system_(system), plan_(plan) {
  if (!plan.worth_it()) return;
  pieces_.reserve(plan.groups.size());
  for (const SchurPlan::Group& group : plan.groups) pieces_.push_back(pieces_of(group));
}

std::vector<SchurSystem::Piece> SchurSystem::pieces_of(const SchurPlan::Group& group) const {
  std::vector<Piece> pieces;
  for (int a : group.members) {
    const int row = plan_.place[static_cast<std::size_t>(a)];
    for (int b : group.members) {
      if (const auto block = b <= a ? system_.block(a, b) : std::nullopt)
        pieces.push_back({*block, row, plan_.place[static_cast<std::size_t>(b)], true, false});
    }
    int column = 0;
    for (int k : group.kept) {
      if (const auto block = k < a ? system_.block(a, k) : system_.block(k, a))
        pieces.push_back({*block, row, column, false, k > a});
      column += system_.dimension(k);
    }
  }
  return pieces;
}

void SchurSystem::gather(std::size_t group, double damping, double floor, Eigen::MatrixXd& A,
                         Eigen::MatrixXd& B) const {
  const SchurPlan::Group& shape = plan_.groups[group];
  A.setZero(shape.size, shape.size);
  B.setZero(shape.size, shape.kept_size);
  for (const Piece& piece : pieces_[group]) {
    Eigen::MatrixXd& to = piece.own ? A : B;
    if (piece.transposed)
      to.block(piece.row, piece.column, piece.block.cols(), piece.block.rows()) = piece.block.transpose();
    else
      to.block(piece.row, piece.column, piece.block.rows(), piece.block.cols()) = piece.block;
  }
  A.diagonal() += damping * A.diagonal() + Eigen::VectorXd::Constant(shape.size, floor);
}

bool SchurSystem::factorize(double damping, double floor) {
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(plan_.reduced, plan_.reduced);
  const auto unknowns = static_cast<int>(plan_.group_of.size());
  for (int a = 0; a < unknowns; ++a) {
    if (plan_.group_of[static_cast<std::size_t>(a)] >= 0) continue;
    system_.for_column(a, [&](int row, const auto& block) {
      if (plan_.group_of[static_cast<std::size_t>(row)] >= 0) return;
      S.block(plan_.place[static_cast<std::size_t>(row)], plan_.place[static_cast<std::size_t>(a)],
              block.rows(), block.cols()) = block;
    });
  }
  S.diagonal() += damping * S.diagonal() + Eigen::VectorXd::Constant(plan_.reduced, floor);
  factors_.resize(plan_.groups.size());
  Eigen::MatrixXd A;
  Eigen::MatrixXd WtW;
  for (std::size_t g = 0; g < plan_.groups.size(); ++g) {
    const SchurPlan::Group& group = plan_.groups[g];
    Factor& factor = factors_[g];
    gather(g, damping, floor, A, factor.W);
    factor.A.compute(A);
    if (factor.A.info() != Eigen::Success) return false;
    factor.A.matrixL().solveInPlace(factor.W);
    const bool among_poses =
        std::ranges::all_of(group.kept, [&](int unknown) { return system_.dimension(unknown) == 6; });
    if (group.size == 6 && among_poses) {
      subtract_pose(plan_, group, factor.W, S);
      continue;
    }
    WtW.noalias() = factor.W.transpose() * factor.W;
    int row = 0;
    for (int r : group.kept) {
      int column = 0;
      for (int c : group.kept) {
        if (c > r) break;
        S.block(plan_.place[static_cast<std::size_t>(r)], plan_.place[static_cast<std::size_t>(c)],
                system_.dimension(r), system_.dimension(c)) -=
            WtW.block(row, column, system_.dimension(r), system_.dimension(c));
        column += system_.dimension(c);
      }
      row += system_.dimension(r);
    }
  }
  if (plan_.reduced > 0) reduced_.compute(S);
  return plan_.reduced == 0 || reduced_.info() == Eigen::Success;
}

Eigen::VectorXd SchurSystem::solve(const Eigen::VectorXd& rhs) const {
  Eigen::VectorXd reduced = Eigen::VectorXd::Zero(plan_.reduced);
  const auto unknowns = static_cast<int>(plan_.group_of.size());
  const auto of = [&](int u) { return plan_.place[static_cast<std::size_t>(u)]; };
  for (int u = 0; u < unknowns; ++u) {
    if (plan_.group_of[static_cast<std::size_t>(u)] < 0)
      reduced.segment(of(u), system_.dimension(u)) = rhs.segment(system_.offset(u), system_.dimension(u));
  }
  std::vector<Eigen::VectorXd> own(plan_.groups.size());
  for (std::size_t g = 0; g < plan_.groups.size(); ++g) {
    const SchurPlan::Group& group = plan_.groups[g];
    own[g].resize(group.size);
    for (int u : group.members)
      own[g].segment(of(u), system_.dimension(u)) = rhs.segment(system_.offset(u), system_.dimension(u));
    factors_[g].A.matrixL().solveInPlace(own[g]);
    const Eigen::VectorXd share = factors_[g].W.transpose() * own[g];
    int at = 0;
    for (int k : group.kept) {
      reduced.segment(of(k), system_.dimension(k)) -= share.segment(at, system_.dimension(k));
      at += system_.dimension(k);
    }
  }
  if (plan_.reduced > 0) reduced = reduced_.solve(reduced).eval();
  Eigen::VectorXd x(rhs.size());
  for (int u = 0; u < unknowns; ++u) {
    if (plan_.group_of[static_cast<std::size_t>(u)] < 0)
      x.segment(system_.offset(u), system_.dimension(u)) = reduced.segment(of(u), system_.dimension(u));
  }
  for (std::size_t g = 0; g < plan_.groups.size(); ++g) {
    const SchurPlan::Group& group = plan_.groups[g];
    Eigen::VectorXd kept(group.kept_size);
    int at = 0;
    for (int k : group.kept) {
      kept.segment(at, system_.dimension(k)) = reduced.segment(of(k), system_.dimension(k));
      at += system_.dimension(k);
    }
    own[g] -= factors_[g].W * kept;
    factors_[g].A.matrixU().solveInPlace(own[g]);
    for (int u : group.members)
      x.segment(system_.offset(u), system_.dimension(u)) = own[g].segment(of(u), system_.dimension(u));
  }
  return x;
}

std::vector<Eigen::MatrixXd> SchurSystem::diagonal_blocks() const {
  std::vector<Eigen::MatrixXd> blocks(plan_.group_of.size());
  const Eigen::MatrixXd P =
      plan_.reduced > 0
          ? Eigen::MatrixXd(reduced_.solve(Eigen::MatrixXd::Identity(plan_.reduced, plan_.reduced)))
          : Eigen::MatrixXd();
  const auto of = [&](int u) { return plan_.place[static_cast<std::size_t>(u)]; };
  for (int u = 0; u < static_cast<int>(blocks.size()); ++u) {
    const int n = system_.dimension(u);
    if (plan_.group_of[static_cast<std::size_t>(u)] < 0)
      blocks[static_cast<std::size_t>(u)] = P.block(of(u), of(u), n, n);
  }
  for (std::size_t g = 0; g < plan_.groups.size(); ++g) {
    const SchurPlan::Group& group = plan_.groups[g];
    Eigen::MatrixXd kept(group.kept_size, group.kept_size);
    int row = 0;
    for (int r : group.kept) {
      int column = 0;
      for (int c : group.kept) {
        kept.block(row, column, system_.dimension(r), system_.dimension(c)) =
            P.block(of(r), of(c), system_.dimension(r), system_.dimension(c));
        column += system_.dimension(c);
      }
      row += system_.dimension(r);
    }
    // A^-1 + A^-1 B P B^T A^-1 = L^-T (I + W P W^T) L^-1.
    Eigen::MatrixXd own = factors_[g].W * kept * factors_[g].W.transpose();
    own.diagonal().array() += 1;
    factors_[g].A.matrixU().solveInPlace(own);
    own.transposeInPlace();
    factors_[g].A.matrixU().solveInPlace(own);
    for (int u : group.members)
      blocks[static_cast<std::size_t>(u)] =
          own.block(of(u), of(u), system_.dimension(u), system_.dimension(u));
  }
  return blocks;
}

}  // namespace waymark::internal
