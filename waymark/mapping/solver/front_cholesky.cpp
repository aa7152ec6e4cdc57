#include "waymark/mapping/solver/front_cholesky.hpp"

#include <algorithm>

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

std::size_t packed(int size) { return at(size) * at(size + 1) / 2; }

}  // namespace

/// Lower triangles of which the last one goes first, as fronts in postorder need them (Liu 1992, section 4),
/// in one piece of memory.
class FrontCholesky::Stack {
 public:
  explicit Stack(std::size_t numbers) : numbers_(static_cast<Eigen::Index>(numbers)) {}

  /// Of the last `size` rows and columns of a matrix.
  void push(const Eigen::Map<Matrix>& matrix, int size) {
    const Eigen::Index skipped = matrix.rows() - size;
    double* to = numbers_.data() + used_;
    for (int c = 0; c < size; ++c) to = std::copy_n(&matrix(skipped + c, skipped + c), size - c, to);
    sizes_.push_back(size);
    used_ += packed(size);
  }
  /// A column of the last one, from the diagonal down.
  [[nodiscard]] const double* column(int c) const {
    const int size = sizes_.back();
    return numbers_.data() + used_ - packed(size - c);
  }
  void pop() {
    used_ -= packed(sizes_.back());
    sizes_.pop_back();
  }

 private:
  Eigen::VectorXd numbers_;
  std::vector<int> sizes_{};
  std::size_t used_ = 0;
};

FrontCholesky::FrontCholesky(const BlockSystem& system, const FrontPlan& plan, const FrontKernels* kernels)
    : system_(system),
      plan_(plan),
      kernels_(kernels != nullptr ? *kernels : *front_kernels().back()),
      blocks_(plan.fronts.size()),
      children_(plan.fronts.size()) {
  for (std::size_t u = 0; u < plan.front_of.size(); ++u) {
    const int column = static_cast<int>(u);
    system.for_column(column, [&](int row, const auto& /*block*/) {
      blocks_[at(std::min(plan.front_of[at(row)], plan.front_of[u]))].emplace_back(row, column);
    });
  }
  std::size_t numbers = 0;
  first_.reserve(plan.fronts.size());
  for (std::size_t f = 0; f < plan.fronts.size(); ++f) {
    const FrontPlan::Front& shape = plan.fronts[f];
    if (shape.parent >= 0) children_[at(shape.parent)].push_back(f);
    first_.push_back(numbers);
    numbers += at(shape.size) * at(shape.own_size);
    largest_ = std::max(largest_, shape.size);
  }
  first_.push_back(numbers);
}

Eigen::Map<const Eigen::MatrixXd> FrontCholesky::columns(std::size_t front) const {
  return {L_.data() + first_[front], plan_.fronts[front].size, plan_.fronts[front].own_size};
}

std::size_t FrontCholesky::largest_stack_of_updates() const {
  std::size_t used = 0;
  std::size_t most = 0;
  const auto numbers = [&](std::size_t f) { return packed(plan_.fronts[f].size - plan_.fronts[f].own_size); };
  for (std::size_t f = 0; f < plan_.fronts.size(); ++f) {
    for (std::size_t child : children_[f]) used -= numbers(child);
    used += numbers(f);
    most = std::max(most, used);
  }
  return most;
}

std::size_t FrontCholesky::largest_stack_of_inverses() const {
  std::size_t used = 0;
  std::size_t most = 0;
  const auto numbers = [&](std::size_t f) { return packed(plan_.fronts[f].size); };
  for (std::size_t f = plan_.fronts.size(); f-- > 0;) {
    if (plan_.fronts[f].first_child) used -= numbers(at(plan_.fronts[f].parent));
    if (!children_[f].empty()) used += numbers(f);
    most = std::max(most, used);
  }
  return most;
}

void FrontCholesky::assemble(std::size_t front, double damping, double floor, const std::vector<int>& place,
                             Eigen::Map<Matrix>& F) const {
  const FrontPlan::Front& shape = plan_.fronts[front];
  for (int c = 0; c < shape.size; ++c) F.col(c).tail(shape.size - c).setZero();
  for (const auto& [row, column] : blocks_[front])
    add_block(F, place[at(row)], place[at(column)], *system_.block(row, column));
  auto diagonal = F.diagonal().head(shape.own_size);
  diagonal += damping * diagonal + Eigen::VectorXd::Constant(shape.own_size, floor);
}

std::vector<FrontCholesky::Run> FrontCholesky::runs_in_parent(std::size_t child,
                                                              const std::vector<int>& place) const {
  const FrontPlan::Front& shape = plan_.fronts[child];
  std::vector<Run> runs;
  for (std::size_t k = at(shape.own); k < shape.unknowns.size(); ++k) {
    const int from = shape.offsets[k] - shape.own_size;
    const int to = place[at(shape.unknowns[k])];
    if (runs.empty() || runs.back().to + runs.back().size != to) runs.push_back({from, to, 0});
    runs.back().size += system_.dimension(shape.unknowns[k]);
  }
  return runs;
}

void FrontCholesky::add_update(std::size_t child, const Stack& updates, const std::vector<int>& place,
                               Eigen::Map<Matrix>& F) const {
  const std::vector<Run> runs = runs_in_parent(child, place);
  for (std::size_t c = 0; c < runs.size(); ++c) {
    for (int k = 0; k < runs[c].size; ++k) {
      const double* update = updates.column(runs[c].from + k);
      auto column = F.col(runs[c].to + k);
      for (std::size_t r = c; r < runs.size(); ++r) {
        const int above = r == c ? k : 0;  // the diagonal
        const int rows = runs[r].size - above;
        const double* part = update + (runs[r].from + above) - (runs[c].from + k);
        column.segment(runs[r].to + above, rows) += Eigen::Map<const Eigen::VectorXd>(part, rows);
      }
    }
  }
}

bool FrontCholesky::factorize(double damping, double floor) {
  L_.resize(static_cast<Eigen::Index>(first_.back()));
  std::vector<int> place(plan_.front_of.size(), 0);
  Stack updates(largest_stack_of_updates());
  Matrix scratch(largest_, largest_);
  for (std::size_t f = 0; f < plan_.fronts.size(); ++f) {
    const FrontPlan::Front& shape = plan_.fronts[f];
    Eigen::Map<Matrix> F(scratch.data(), shape.size, shape.size);
    set_places(shape, place);
    assemble(f, damping, floor, place, F);
    for (std::size_t child = children_[f].size(); child-- > 0;) {
      add_update(children_[f][child], updates, place, F);
      updates.pop();
    }
    if (!kernels_.eliminate(F.data(), shape.size, shape.own_size)) return false;
    updates.push(F, shape.size - shape.own_size);
    std::copy_n(F.data(), at(shape.size) * at(shape.own_size), L_.data() + first_[f]);
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
    const auto L = columns(f);
    L.topRows(shape.own_size).triangularView<Eigen::Lower>().solveInPlace(part.head(shape.own_size));
    part.tail(shape.size - shape.own_size).noalias() -=
        L.bottomRows(shape.size - shape.own_size) * part.head(shape.own_size);
    move(shape, 0, shape.unknowns.size(), true);
  }
  for (std::size_t f = plan_.fronts.size(); f-- > 0;) {
    const FrontPlan::Front& shape = plan_.fronts[f];
    const auto L = columns(f);
    part.resize(shape.size);
    move(shape, 0, shape.unknowns.size(), false);
    part.head(shape.own_size).noalias() -=
        L.bottomRows(shape.size - shape.own_size).transpose() * part.tail(shape.size - shape.own_size);
    L.topRows(shape.own_size)
        .transpose()
        .triangularView<Eigen::Upper>()
        .solveInPlace(part.head(shape.own_size));
    move(shape, 0, at(shape.own), true);
  }
  return x;
}

void FrontCholesky::copy_known(std::size_t front, const Stack& inverses, const std::vector<int>& place,
                               Eigen::Map<Matrix>& Z) const {
  const std::vector<Run> runs = runs_in_parent(front, place);
  const int rows_of_known = plan_.fronts[front].size - plan_.fronts[front].own_size;
  auto known = Z.bottomRightCorner(rows_of_known, rows_of_known);
  for (std::size_t c = 0; c < runs.size(); ++c) {
    for (int k = 0; k < runs[c].size; ++k) {
      const double* inverse = inverses.column(runs[c].to + k);
      auto column = known.col(runs[c].from + k);
      for (std::size_t r = c; r < runs.size(); ++r) {
        const int above = r == c ? k : 0;
        const int rows = runs[r].size - above;
        const double* part = inverse + (runs[r].to + above) - (runs[c].to + k);
        column.segment(runs[r].from + above, rows) = Eigen::Map<const Eigen::VectorXd>(part, rows);
      }
    }
  }
  for (int c = 1; c < rows_of_known; ++c) known.col(c).head(c) = known.row(c).head(c).transpose();
}

std::vector<Eigen::MatrixXd> FrontCholesky::inverse_blocks(
    std::span<const std::pair<int, int>> wanted) const {
  std::vector<std::vector<std::size_t>> wanted_of(plan_.fronts.size());
  for (std::size_t i = 0; i < wanted.size(); ++i)
    wanted_of[at(std::min(plan_.front_of[at(wanted[i].first)], plan_.front_of[at(wanted[i].second)]))]
        .push_back(i);
  std::vector<Matrix> result(wanted.size());
  Stack inverses(largest_stack_of_inverses());
  Matrix scratch(largest_, largest_);
  std::vector<int> place(plan_.front_of.size(), 0);
  for (std::size_t f = plan_.fronts.size(); f-- > 0;) {
    const FrontPlan::Front& shape = plan_.fronts[f];
    Eigen::Map<Matrix> Z(scratch.data(), shape.size, shape.size);
    if (shape.parent >= 0) {
      set_places(plan_.fronts[at(shape.parent)], place);
      copy_known(f, inverses, place, Z);
      if (shape.first_child) inverses.pop();
    }
    kernels_.invert(columns(f).data(), shape.size, shape.own_size, Z.data());
    if (!children_[f].empty()) inverses.push(Z, shape.size);
    set_places(shape, place);
    for (std::size_t i : wanted_of[f]) {
      const auto& [row, column] = wanted[i];
      result[i] =
          Z.block(place[at(row)], place[at(column)], system_.dimension(row), system_.dimension(column));
    }
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
