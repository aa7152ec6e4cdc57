#include "waymark/mapping/solver/front_cholesky.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <Eigen/SparseCore>

#include "waymark/mapping/solver/elimination_order.hpp"

namespace waymark::internal {
namespace {

using Lists = std::vector<std::vector<int>>;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// For each step, the later steps in which its column of the factor has entries.
Lists columns_of_factor(const std::vector<int>& order, const std::vector<std::pair<int, int>>& couplings) {
  std::vector<int> step(order.size());
  for (std::size_t s = 0; s < order.size(); ++s) step[at(order[s])] = static_cast<int>(s);
  Lists columns(order.size());
  for (const auto& [a, b] : couplings) {
    const auto [early, late] = std::minmax(step[at(a)], step[at(b)]);
    columns[at(early)].push_back(late);
  }
  // A column passes its entries to its parent, which is the first of these steps.
  for (std::vector<int>& column : columns) {
    std::ranges::sort(column);
    column.erase(std::ranges::unique(column).begin(), column.end());
    if (column.empty()) continue;
    std::vector<int>& parent = columns[at(column.front())];
    parent.insert(parent.end(), column.begin() + 1, column.end());
  }
  return columns;
}

/// A front that is being built.
struct Draft {
  std::vector<int> own{};   ///< steps eliminated in this front
  std::vector<int> rows{};  ///< later steps coupled to them
  int zeros = 0;            ///< stored entries that are structurally zero
  int parent = -1;
  double work = 0;  ///< amount of work in its subtree
};

/// The number of stored zeros if the next step is eliminated in the same front.
int zeros_when_joined(const Draft& draft, std::size_t rows) {
  return draft.zeros + static_cast<int>(draft.own.size() * (rows + 1 - draft.rows.size()));
}

bool worth_joining(const Draft& draft, std::size_t rows) {
  constexpr double kShare = 0.2;
  const auto own = static_cast<double>(draft.own.size() + 1);
  return zeros_when_joined(draft, rows) <= kShare * own * (own / 2 + static_cast<double>(rows));
}

std::vector<Draft> drafts_of(Lists columns) {
  std::vector<Draft> drafts;
  Lists waiting(columns.size());  // drafts, listed by the step that is their first row
  for (std::size_t s = 0; s < columns.size(); ++s) {
    std::vector<int>& rows = columns[s];
    int best = -1;
    for (int child : waiting[s]) {
      const Draft& draft = drafts[at(child)];
      if (!worth_joining(draft, rows.size())) continue;
      if (best < 0 || draft.own.size() > drafts[at(best)].own.size()) best = child;
    }
    int here = best;
    if (best < 0) {
      here = static_cast<int>(drafts.size());
      drafts.emplace_back();
    }
    Draft& draft = drafts[at(here)];
    draft.zeros = best < 0 ? 0 : zeros_when_joined(draft, rows.size());
    draft.own.push_back(static_cast<int>(s));
    draft.rows = std::move(rows);
    for (int child : waiting[s]) {
      if (child != here) drafts[at(child)].parent = here;
    }
    if (!draft.rows.empty()) waiting[at(draft.rows.front())].push_back(here);
  }
  return drafts;
}

/// The drafts in postorder. The child with the most work comes first, which keeps the stack of updates small.
std::vector<int> postorder(std::vector<Draft>& drafts) {
  std::vector<int> by_last_step(drafts.size());
  for (std::size_t i = 0; i < drafts.size(); ++i) by_last_step[i] = static_cast<int>(i);
  std::ranges::sort(by_last_step, {}, [&](int i) { return drafts[at(i)].own.back(); });
  Lists children(drafts.size());
  std::vector<int> roots;
  for (int i : by_last_step) {
    Draft& draft = drafts[at(i)];
    const auto size = static_cast<double>(draft.own.size() + draft.rows.size());
    draft.work += static_cast<double>(draft.own.size()) * size * size;
    (draft.parent < 0 ? roots : children[at(draft.parent)]).push_back(i);
    if (draft.parent >= 0) drafts[at(draft.parent)].work += draft.work;
  }
  std::vector<int> order;
  std::vector<int> stack = roots;
  while (!stack.empty()) {  // visits parents before children; the order is reversed below
    const int i = stack.back();
    stack.pop_back();
    order.push_back(i);
    std::ranges::stable_sort(children[at(i)], std::greater<>{}, [&](int c) { return drafts[at(c)].work; });
    for (int c : children[at(i)]) stack.push_back(c);
  }
  std::ranges::reverse(order);
  return order;
}

}  // namespace

FrontPlan front_plan(const BlockSystem& system) {
  std::vector<std::pair<int, int>> couplings;
  for (int column = 0; column < system.unknowns(); ++column) {
    system.for_column(column, [&](int row, const auto& /*block*/) {
      if (row != column) couplings.emplace_back(row, column);
    });
  }
  const std::vector<int> order = elimination_order(system.unknowns(), couplings);
  std::vector<Draft> drafts = drafts_of(columns_of_factor(order, couplings));
  const std::vector<int> sequence = postorder(drafts);
  std::vector<int> place(drafts.size());
  for (std::size_t i = 0; i < sequence.size(); ++i) place[at(sequence[i])] = static_cast<int>(i);
  FrontPlan plan{.front_of = std::vector<int>(at(system.unknowns()), -1)};
  std::vector<char> has_child(drafts.size(), 0);
  for (int i : sequence) {
    const Draft& draft = drafts[at(i)];
    FrontPlan::Front front{.own = static_cast<int>(draft.own.size())};
    const auto add = [&](int step) {
      front.unknowns.push_back(order[at(step)]);
      front.offsets.push_back(front.size);
      front.size += system.dimension(order[at(step)]);
    };
    for (int step : draft.own) add(step);
    front.own_size = front.size;
    for (int step : draft.rows) add(step);
    for (int k = 0; k < front.own; ++k)
      plan.front_of[at(front.unknowns[at(k)])] = static_cast<int>(plan.fronts.size());
    if (draft.parent >= 0) {
      front.parent = place[at(draft.parent)];
      front.first_child = std::exchange(has_child[at(draft.parent)], char{1}) == 0;
    }
    plan.fronts.push_back(std::move(front));
  }
  return plan;
}

namespace {

/// Writes the index of each unknown's first scalar within the front to `place`, which is indexed by unknown.
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

/// A stack of packed lower triangles in one array, as required for processing fronts in postorder (Liu 1992,
/// section 4).
class FrontCholesky::Stack {
 public:
  explicit Stack(std::size_t numbers) : numbers_(static_cast<Eigen::Index>(numbers)) {}

  /// Pushes the last `size` rows and columns of a matrix.
  void push(const Eigen::Map<Matrix>& matrix, int size) {
    const Eigen::Index skipped = matrix.rows() - size;
    double* to = numbers_.data() + used_;
    for (int c = 0; c < size; ++c) to = std::copy_n(&matrix(skipped + c, skipped + c), size - c, to);
    sizes_.push_back(size);
    used_ += packed(size);
  }
  /// A column of the triangle at the top of the stack, from the diagonal down.
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
        const int above = r == c ? k : 0;  // diagonal blocks are stored only from the diagonal down
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
  std::vector<Matrix> result(wanted.size());
  visit_inverse_blocks(wanted, [&](std::size_t i, const auto& block) { result[i] = block; });
  return result;
}

void FrontCholesky::visit_inverse_blocks(std::span<const std::pair<int, int>> wanted,
                                         const BlockVisitor& visit) const {
  std::vector<std::vector<std::size_t>> wanted_of(plan_.fronts.size());
  for (std::size_t i = 0; i < wanted.size(); ++i)
    wanted_of[at(std::min(plan_.front_of[at(wanted[i].first)], plan_.front_of[at(wanted[i].second)]))]
        .push_back(i);
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
      visit(i, Z.block(place[at(row)], place[at(column)], system_.dimension(row), system_.dimension(column)));
    }
  }
}

std::optional<Eigen::VectorXd> damped_step(FrontCholesky& cholesky, const BlockSystem& system,
                                           double damping) {
  constexpr double kDiagonalFloor = 1e-12;  // keeps undetermined unknowns at their values
  if (!cholesky.factorize(damping, kDiagonalFloor)) return std::nullopt;
  Eigen::VectorXd step = cholesky.solve(-system.gradient());
  if (!step.allFinite()) return std::nullopt;
  return step;
}

namespace {

/// Ends when one more iteration would reduce the quadratic model by less than a given share of its mean gain
/// (Nash and Sofer, "Assessing a search direction within a truncated-Newton method", Operations Research
/// Letters 9(4), 1990), or by less than `negligible_gain`.
std::optional<Eigen::VectorXd> conjugate_gradients(const BlockSystem& system, double damping,
                                                   double negligible_gain,
                                                   const FrontCholesky& preconditioner) {
  constexpr double kDiagonalFloor = 1e-12;  // keeps undetermined unknowns at their values
  constexpr double kMinGainShare = 1e-3;
  constexpr int kMaxIterations = 25;
  const auto H = system.lower().selfadjointView<Eigen::Lower>();
  const Eigen::VectorXd added = (damping * system.lower().diagonal()).array() + kDiagonalFloor;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(added.size());
  Eigen::VectorXd r = -system.gradient();
  Eigen::VectorXd z = preconditioner.solve(r);
  Eigen::VectorXd p = z;
  double rz = r.dot(z);
  double gained = 0;
  for (int i = 1; i <= kMaxIterations; ++i) {
    if (!(rz > 0)) return x;
    const Eigen::VectorXd Hp = H * p + added.cwiseProduct(p);
    const double curvature = p.dot(Hp);
    if (!(curvature > 0)) return std::nullopt;
    const double length = rz / curvature;
    x += length * p;
    r -= length * Hp;
    const double gain = length * rz / 2;
    gained += gain;
    if (i * gain <= std::max(kMinGainShare * gained, negligible_gain)) return x;
    z = preconditioner.solve(r);
    const double before = rz;
    rz = r.dot(z);
    p = z + (rz / before) * p;
  }
  return std::nullopt;
}

}  // namespace

KeptFactor::Factor::Factor(const BlockSystem& of)
    : system(of), plan(front_plan(system)), cholesky(system, plan) {}

bool KeptFactor::fits(const BlockSystem& system) const {
  if (!factor_ || factor_->system.unknowns() != system.unknowns()) return false;
  for (int u = 0; u < system.unknowns(); ++u) {
    if (factor_->system.dimension(u) != system.dimension(u)) return false;
  }
  return true;
}

std::optional<Eigen::VectorXd> KeptFactor::step(const BlockSystem& system, double damping,
                                                double negligible_gain) {
  if (fits(system)) {
    std::optional<Eigen::VectorXd> found =
        conjugate_gradients(system, damping, negligible_gain, factor_->cholesky);
    if (found && found->allFinite()) return found;
  }
  factor_.reset();
  factor_ = std::make_unique<Factor>(system);
  std::optional<Eigen::VectorXd> found = damped_step(factor_->cholesky, factor_->system, damping);
  if (!found) factor_.reset();
  return found;
}

bool worth_keeping(const FrontPlan& plan, const BlockSystem& system) {
  constexpr double kMinWorkPerEntry = 1000;
  double work = 0;
  for (const FrontPlan::Front& front : plan.fronts)
    work += static_cast<double>(front.own_size) * static_cast<double>(front.size) *
            static_cast<double>(front.size);
  return work > kMinWorkPerEntry * static_cast<double>(system.lower().nonZeros());
}

}  // namespace waymark::internal
