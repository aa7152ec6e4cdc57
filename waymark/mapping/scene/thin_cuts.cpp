#include "waymark/mapping/scene/thin_cuts.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

namespace waymark {
namespace {

constexpr std::size_t kSmallView = 8;  // tags; of larger ones only neighbours in the list are tied
constexpr std::size_t kTies = 4;

/// The tags of each view, ascending.
std::vector<std::vector<PoseIndex>> views_of(const Bundle& bundle, const std::vector<char>& moves) {
  std::map<std::pair<PoseIndex, PoseIndex>, std::vector<PoseIndex>> views;
  for (const CornerTerm& term : bundle.corners) {
    if (!term.used) continue;
    if (moves[term.rig] != 0 || moves[term.body] != 0) views[{term.rig, term.body}].push_back(term.tag);
  }
  std::vector<std::vector<PoseIndex>> result;
  for (auto& [key, tags] : views) {
    std::ranges::sort(tags);
    tags.erase(std::ranges::unique(tags).begin(), tags.end());
    if (tags.size() > 1) result.push_back(std::move(tags));
  }
  return result;
}

struct Tie {
  PoseIndex a = 0, b = 0;
  int views = 0;
};

/// The maximum spanning forest (Kruskal, "On the shortest spanning subtree of a graph", 1956).
std::vector<Tie> spanning_tree(const std::vector<std::vector<PoseIndex>>& views, std::size_t poses) {
  std::map<std::pair<PoseIndex, PoseIndex>, int> together;
  for (const auto& tags : views) {
    const std::size_t reach = tags.size() <= kSmallView ? tags.size() : kTies;
    for (std::size_t i = 0; i < tags.size(); ++i) {
      for (std::size_t j = i + 1; j < tags.size() && j <= i + reach; ++j) ++together[{tags[i], tags[j]}];
    }
  }
  std::vector<Tie> ties;
  for (const auto& [pair, count] : together) ties.push_back({pair.first, pair.second, count});
  std::ranges::stable_sort(ties, std::greater<>{}, &Tie::views);
  std::vector<PoseIndex> parent(poses);
  std::iota(parent.begin(), parent.end(), PoseIndex{0});
  const auto root = [&](PoseIndex i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<Tie> tree;
  for (const Tie& tie : ties) {
    const PoseIndex a = root(tie.a);
    const PoseIndex b = root(tie.b);
    if (a == b) continue;
    parent[a] = b;
    tree.push_back(tie);
  }
  return tree;
}

using Neighbours = std::map<PoseIndex, std::vector<PoseIndex>>;

/// What hangs on `from` when the tie to `without` is cut.
std::set<PoseIndex> side_of(const Neighbours& neighbours, PoseIndex from, PoseIndex without) {
  std::set<PoseIndex> side = {from};
  std::vector<PoseIndex> next = {from};
  while (!next.empty()) {
    const PoseIndex at = next.back();
    next.pop_back();
    for (PoseIndex other : neighbours.at(at)) {
      if ((at == from && other == without) || !side.insert(other).second) continue;
      next.push_back(other);
    }
  }
  return side;
}

ThinCut cut_of(const std::vector<std::vector<PoseIndex>>& views, const std::set<PoseIndex>& beyond) {
  ThinCut cut{.beyond = {beyond.begin(), beyond.end()}};
  std::set<PoseIndex> by;
  for (const auto& tags : views) {
    std::vector<PoseIndex> there;
    std::vector<PoseIndex> here;
    for (PoseIndex tag : tags) (beyond.contains(tag) ? there : here).push_back(tag);
    const auto& fewer = here.size() <= there.size() ? here : there;
    cut.observations += static_cast<int>(fewer.size());
    by.insert(fewer.begin(), fewer.end());
  }
  cut.by = {by.begin(), by.end()};
  return cut;
}

}  // namespace

std::vector<ThinCut> thin_cuts(const Bundle& bundle, const std::vector<char>& moves,
                               const std::set<PoseIndex>& roots, int most) {
  if (!bundle.relatives.empty()) return {};
  const std::vector<std::vector<PoseIndex>> views = views_of(bundle, moves);
  const std::vector<Tie> tree = spanning_tree(views, bundle.poses.size());
  Neighbours neighbours;
  for (const Tie& tie : tree) {
    neighbours[tie.a].push_back(tie.b);
    neighbours[tie.b].push_back(tie.a);
  }
  std::vector<ThinCut> cuts;
  constexpr int kMostTried = 200;
  int tried = 0;
  for (auto tie = tree.rbegin(); tie != tree.rend() && tie->views <= most && tried < kMostTried;
       ++tie, ++tried) {
    std::set<PoseIndex> beyond = side_of(neighbours, tie->a, tie->b);
    const auto known = [&](PoseIndex tag) { return roots.contains(tag); };
    if (std::ranges::any_of(beyond, known)) beyond = side_of(neighbours, tie->b, tie->a);
    if (beyond.size() < 2 || std::ranges::any_of(beyond, known)) continue;
    ThinCut cut = cut_of(views, beyond);
    if (cut.observations <= most) cuts.push_back(std::move(cut));
  }
  std::ranges::stable_sort(cuts, std::greater<>{}, [](const ThinCut& cut) { return cut.beyond.size(); });
  std::vector<ThinCut> kept;
  for (ThinCut& cut : cuts) {
    const bool within = std::ranges::any_of(kept, [&](const ThinCut& other) {
      return other.observations <= cut.observations && std::ranges::includes(other.beyond, cut.beyond);
    });
    if (!within) kept.push_back(std::move(cut));
  }
  return kept;
}

}  // namespace waymark
