#include "waymark/mapping/solver/elimination_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace waymark::internal {
namespace {

using Couplings = std::vector<std::pair<int, int>>;

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

std::vector<int> minimum_degree(int unknowns, const Couplings& couplings) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(2 * couplings.size() + as_index(unknowns));
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

/// The unknowns that the minimum-degree algorithm puts last because of their many couplings.
std::vector<char> dense_unknowns(int unknowns, const Couplings& couplings) {
  constexpr int kMinDegree = 16;
  const int most = std::max(kMinDegree, static_cast<int>(10 * std::sqrt(static_cast<double>(unknowns))));
  std::vector<int> degree(as_index(unknowns), 0);
  for (const auto& [a, b] : couplings) {
    ++degree[as_index(a)];
    ++degree[as_index(b)];
  }
  std::vector<char> dense(degree.size());
  std::ranges::transform(degree, dense.begin(), [&](int d) { return d > most ? 1 : 0; });
  return dense;
}

/// The couplings between unknowns that are not dense. Unknowns with at most two of them form chains.
class Chains {
 public:
  Chains(int unknowns, const Couplings& couplings)
      : dense_(dense_unknowns(unknowns, couplings)), neighbours_(as_index(unknowns)) {
    for (const auto& [a, b] : couplings) {
      if (dense_[as_index(a)] != 0 || dense_[as_index(b)] != 0) continue;
      neighbours_[as_index(a)].push_back(b);
      neighbours_[as_index(b)].push_back(a);
    }
  }

  /// Whether most unknowns are in chains, coupled to the others by dense unknowns only.
  [[nodiscard]] bool prevail() const {
    const auto in_chain = [&](const auto& of) { return !of.empty() && of.size() <= kMaxNeighbours; };
    return std::ranges::any_of(dense_, [](char dense) { return dense != 0; }) &&
           2 * std::ranges::count_if(neighbours_, in_chain) > std::ssize(neighbours_);
  }

  /// Eliminates chains in rounds until no unknown has at most two neighbours. Returns the order.
  std::vector<int> eliminate() {
    std::vector<int> order;
    std::vector<int> candidates;
    for (int i = 0; i < static_cast<int>(neighbours_.size()); ++i) {
      if (may_go(i)) candidates.push_back(i);
    }
    std::vector<int> last_round(neighbours_.size(), -1);  // in which a neighbour was eliminated
    for (int round = 0; !candidates.empty(); ++round) {
      std::vector<int> next;
      for (const int i : candidates) {
        if (last_round[as_index(i)] == round) continue;  // is in `next`
        for (const int neighbour : remove(i)) {
          if (last_round[as_index(neighbour)] != round) next.push_back(neighbour);
          last_round[as_index(neighbour)] = round;
        }
        order.push_back(i);
      }
      std::erase_if(next, [&](int i) { return !may_go(i); });
      std::ranges::sort(next);  // in the order of time, in which neighbours alternate
      candidates = std::move(next);
    }
    return order;
  }

 private:
  static constexpr std::size_t kMaxNeighbours = 2;

  [[nodiscard]] bool may_go(int i) const {
    return dense_[as_index(i)] == 0 && neighbours_[as_index(i)].size() <= kMaxNeighbours;
  }

  /// Removes an unknown, couples its neighbours to each other, and returns these.
  std::vector<int> remove(int i) {
    std::vector<int> of = std::move(neighbours_[as_index(i)]);
    for (const int neighbour : of) std::erase(neighbours_[as_index(neighbour)], i);
    if (of.size() == 2) couple(of[0], of[1]);
    return of;
  }
  void couple(int a, int b) {
    if (std::ranges::find(neighbours_[as_index(a)], b) != neighbours_[as_index(a)].end()) return;
    neighbours_[as_index(a)].push_back(b);
    neighbours_[as_index(b)].push_back(a);
  }

  std::vector<char> dense_;
  std::vector<std::vector<int>> neighbours_;
};

}  // namespace

std::vector<int> elimination_order(int unknowns, const Couplings& couplings) {
  Chains chains(unknowns, couplings);
  if (!chains.prevail()) return minimum_degree(unknowns, couplings);
  std::vector<int> order = chains.eliminate();
  std::vector<int> place(as_index(unknowns), 0);  // among the others; -1 if eliminated
  for (const int i : order) place[as_index(i)] = -1;
  std::vector<int> others;
  for (int i = 0; i < unknowns; ++i) {
    if (place[as_index(i)] < 0) continue;
    place[as_index(i)] = static_cast<int>(others.size());
    others.push_back(i);
  }
  Couplings between_others;
  for (const auto& [a, b] : couplings) {
    if (place[as_index(a)] >= 0 && place[as_index(b)] >= 0)
      between_others.emplace_back(place[as_index(a)], place[as_index(b)]);
  }
  for (const int i : minimum_degree(static_cast<int>(others.size()), between_others))
    order.push_back(others[as_index(i)]);
  return order;
}

}  // namespace waymark::internal
