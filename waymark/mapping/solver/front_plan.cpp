#include "waymark/mapping/solver/front_plan.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace waymark::internal {
namespace {

using Lists = std::vector<std::vector<int>>;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// Unknowns by the step in which they are eliminated.
std::vector<int> minimum_degree(int unknowns, const std::vector<std::pair<int, int>>& couplings) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(2 * couplings.size() + at(unknowns));
  for (const auto& [a, b] : couplings) {
    entries.emplace_back(a, b, 1);
    entries.emplace_back(b, a, 1);
  }
  for (int i = 0; i < unknowns; ++i) entries.emplace_back(i, i, 1);
  Eigen::SparseMatrix<double> pattern(unknowns, unknowns);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(pattern, permutation);
  return {permutation.indices().data(), permutation.indices().data() + unknowns};
}

/// Of each step, the later steps its column of the factor has entries in.
Lists columns_of_factor(const std::vector<int>& order, const std::vector<std::pair<int, int>>& couplings) {
  std::vector<int> step(order.size());
  for (std::size_t s = 0; s < order.size(); ++s) step[at(order[s])] = static_cast<int>(s);
  Lists columns(order.size());
  for (const auto& [a, b] : couplings) {
    const auto [early, late] = std::minmax(step[at(a)], step[at(b)]);
    columns[at(early)].push_back(late);
  }
  // A column hands its entries on to the first of them, its parent.
  for (std::vector<int>& column : columns) {
    std::ranges::sort(column);
    column.erase(std::ranges::unique(column).begin(), column.end());
    if (column.empty()) continue;
    std::vector<int>& parent = columns[at(column.front())];
    parent.insert(parent.end(), column.begin() + 1, column.end());
  }
  return columns;
}

/// A front while they are put together.
struct Draft {
  std::vector<int> own{};   ///< steps
  std::vector<int> rows{};  ///< later steps
  int zeros = 0;            ///< entries that are stored though they are zero
  int parent = -1;
  double work = 0;  ///< of itself and everything below
};

/// What it costs to eliminate the next step together with a front that hands on to it.
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
  Lists waiting(columns.size());  // drafts whose first row is this step
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

/// Drafts, children before their parents, the heaviest child first: then little has to be kept for later.
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
  while (!stack.empty()) {  // parents before children, to be turned round
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
  const std::vector<int> order = minimum_degree(system.unknowns(), couplings);
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

}  // namespace waymark::internal
