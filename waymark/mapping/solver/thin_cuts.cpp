#include "waymark/mapping/solver/thin_cuts.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/solver/disjoint_sets.hpp"

namespace waymark {
namespace {

// Number of tags; in larger views, only tags that are adjacent in the list are connected.
constexpr std::size_t kMaxFullView = 8;
constexpr std::size_t kTiesPerTag = 4;

/// A tag in a view, and its corner terms there.
struct TagInView {
  PoseIndex tag = 0;
  std::vector<std::size_t> terms{};

  [[nodiscard]] int count() const { return static_cast<int>(terms.size()); }
};
/// In ascending order of the tags.
using SharedView = std::vector<TagInView>;

/// Sets of poses that measured motion connects.
internal::DisjointSets sets_by_motion(const Bundle& bundle, const std::vector<char>& moves) {
  internal::DisjointSets sets(bundle.poses.size());
  const auto join = [&](PoseIndex a, PoseIndex b) {
    if (moves[a] != 0 && moves[b] != 0) sets.join(a, b);
  };
  for (const RelativeTerm& term : bundle.relatives) {
    if (term.used) join(term.a, term.b);
  }
  for (const OdometryTerm& term : bundle.odometry) join(term.a, term.b);
  return sets;
}

/// The views with at least two tags.
std::vector<SharedView> views_of(const Bundle& bundle, const std::vector<char>& moves, ImageTies ties) {
  internal::DisjointSets sets =
      ties == ImageTies::Moving ? sets_by_motion(bundle, moves) : internal::DisjointSets(bundle.poses.size());
  std::map<std::pair<PoseIndex, PoseIndex>, std::map<PoseIndex, std::vector<std::size_t>>> views;
  for (std::size_t i = 0; i < bundle.corners.size(); ++i) {
    const CornerTerm& term = bundle.corners[i];
    if (!term.used || (moves[term.rig] == 0 && moves[term.body] == 0)) continue;
    views[{sets.root(term.rig), sets.root(term.body)}][term.tag].push_back(i);
  }
  std::vector<SharedView> result;
  for (auto& [key, tags] : views) {
    if (tags.size() < 2) continue;
    SharedView& view = result.emplace_back();
    for (auto& [tag, terms] : tags) view.push_back({tag, std::move(terms)});
  }
  return result;
}

struct CommonViews {
  PoseIndex a = 0, b = 0;
  int views = 0;
};

/// The number of views or observations that connect two tags.
using TiesOfPairs = std::map<std::pair<PoseIndex, PoseIndex>, int>;

/// Connects the tags of a view that has several observations of a tag to the one with the most of them.
void tie_to_most_observed(const SharedView& view, TiesOfPairs& together) {
  const TagInView& hub = *std::ranges::max_element(view, {}, &TagInView::count);
  for (const TagInView& tag : view) {
    if (tag.tag != hub.tag) together[std::minmax(hub.tag, tag.tag)] += tag.count();
  }
}

void tie_all(const SharedView& view, TiesOfPairs& together) {
  const std::size_t reach = view.size() <= kMaxFullView ? view.size() : kTiesPerTag;
  for (std::size_t i = 0; i < view.size(); ++i) {
    for (std::size_t j = i + 1; j < view.size() && j <= i + reach; ++j)
      ++together[{view[i].tag, view[j].tag}];
  }
}

/// The maximum spanning forest (Kruskal, "On the shortest spanning subtree of a graph", 1956).
std::vector<CommonViews> spanning_tree(const std::vector<SharedView>& views, std::size_t poses) {
  TiesOfPairs together;
  for (const SharedView& view : views) {
    const bool several = std::ranges::any_of(view, [](const TagInView& tag) { return tag.count() > 1; });
    several ? tie_to_most_observed(view, together) : tie_all(view, together);
  }
  std::vector<CommonViews> ties;
  ties.reserve(together.size());
  for (const auto& [pair, count] : together) ties.push_back({pair.first, pair.second, count});
  std::ranges::stable_sort(ties, std::greater<>{}, &CommonViews::views);
  internal::DisjointSets sets(poses);
  std::vector<CommonViews> tree;
  for (const CommonViews& tie : ties) {
    if (sets.root(tie.a) == sets.root(tie.b)) continue;
    sets.join(tie.a, tie.b);
    tree.push_back(tie);
  }
  return tree;
}

using TagNeighbours = std::map<PoseIndex, std::vector<PoseIndex>>;

/// The tags connected to `from` if the edge to `without` is removed.
std::set<PoseIndex> side_of(const TagNeighbours& neighbours, PoseIndex from, PoseIndex without) {
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

/// The observations in a view on the side of a cut that has fewer of them.
std::vector<const TagInView*> fewer_across(const SharedView& view, const std::set<PoseIndex>& beyond) {
  std::vector<const TagInView*> there;
  std::vector<const TagInView*> here;
  for (const TagInView& tag : view) (beyond.contains(tag.tag) ? there : here).push_back(&tag);
  const auto count = [](const std::vector<const TagInView*>& tags) {
    int sum = 0;
    for (const TagInView* tag : tags) sum += tag->count();
    return sum;
  };
  return count(here) <= count(there) ? here : there;
}

ThinCut thin_cut_of(const std::vector<SharedView>& views, const std::set<PoseIndex>& beyond) {
  ThinCut cut{.beyond = {beyond.begin(), beyond.end()}};
  std::set<PoseIndex> by;
  for (const SharedView& view : views) {
    for (const TagInView* tag : fewer_across(view, beyond)) {
      cut.observations += tag->count();
      by.insert(tag->tag);
    }
  }
  cut.by = {by.begin(), by.end()};
  return cut;
}

/// Removes cuts within a larger part that depends on at most as many observations. The largest one comes
/// first.
std::vector<ThinCut> without_nested(std::vector<ThinCut> cuts) {
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

}  // namespace

std::vector<ThinCut> thin_cuts(const Bundle& bundle, const std::vector<char>& moves,
                               const std::set<PoseIndex>& roots, ImageTies ties, int most) {
  const std::vector<SharedView> views = views_of(bundle, moves, ties);
  const std::vector<CommonViews> tree = spanning_tree(views, bundle.poses.size());
  TagNeighbours neighbours;
  for (const CommonViews& tie : tree) {
    neighbours[tie.a].push_back(tie.b);
    neighbours[tie.b].push_back(tie.a);
  }
  std::vector<ThinCut> cuts;
  constexpr int kMaxTried = 200;
  int tried = 0;
  for (auto tie = tree.rbegin(); tie != tree.rend() && tie->views <= most && tried < kMaxTried; ++tie) {
    std::set<PoseIndex> beyond = side_of(neighbours, tie->a, tie->b);
    const auto known = [&](PoseIndex tag) { return roots.contains(tag); };
    if (std::ranges::any_of(beyond, known)) beyond = side_of(neighbours, tie->b, tie->a);
    if (beyond.size() < 2 || std::ranges::any_of(beyond, known)) continue;
    ++tried;
    ThinCut cut = thin_cut_of(views, beyond);
    if (cut.observations <= most) cuts.push_back(std::move(cut));
  }
  return without_nested(std::move(cuts));
}

std::vector<ThinCut> rarely_observed_tags(const Bundle& bundle, const std::set<PoseIndex>& roots, int most) {
  std::map<PoseIndex, int> count;
  for (const CornerTerm& term : bundle.corners) count[term.tag] += term.used ? 1 : 0;
  std::vector<ThinCut> rare;
  for (const auto& [tag, observations] : count) {
    if (observations == 0 || observations > most || roots.contains(tag)) continue;
    rare.push_back({.beyond = {tag}, .by = {tag}, .observations = observations});
  }
  return rare;
}

namespace {

bool has_motion(const Bundle& bundle) { return !bundle.relatives.empty() || !bundle.odometry.empty(); }

/// Whether priors or distances connect tags.
bool has_given_ties(const Bundle& bundle, const std::set<PoseIndex>& roots) {
  const bool weak_priors =
      std::ranges::any_of(bundle.priors, [&](const PriorTerm& prior) { return !roots.contains(prior.pose); });
  return weak_priors || !bundle.pair_priors.empty() || !bundle.distances.empty() ||
         !bundle.point_distances.empty() || !bundle.point_coordinates.empty();
}

double position_variance(const SE3& pose, const Matrix6& covariance) {
  const Matrix6 P = coordinate_covariance(Uncertain<SE3>{pose, covariance});
  return P.topLeftCorner<3, 3>().trace();
}

/// Whether the variance of a position beyond the cut is much larger without its observations. Fills in that
/// standard deviation.
bool is_unchecked(const Bundle& bundle, const BundleCovariance& P, const BundleCovariance& without,
                  ThinCut& cut) {
  constexpr double kMaxVarianceRatio = 2;
  constexpr double kGate = 5;             // standard deviations by which an accepted observation may be wrong
  constexpr double kNegligible_m = 0.02;  // displacement
  bool unchecked = false;
  double largest = 0;
  for (const PoseIndex tag : cut.beyond) {
    const SE3& pose = bundle.poses[tag].value;
    const double variance = position_variance(pose, without.poses[tag]);
    // The covariance of a pose that is in no term is zero.
    if (!(variance > 0) || std::ranges::binary_search(without.undetermined, tag)) return true;
    largest = std::max(largest, variance);
    unchecked = unchecked || (variance > kMaxVarianceRatio * position_variance(pose, P.poses[tag]) &&
                              kGate * std::sqrt(variance) > kNegligible_m);
  }
  cut.otherwise_sigma_m = std::sqrt(largest);
  return unchecked;
}

/// The corner terms that connect the parts beyond these cuts.
std::set<std::size_t> terms_across(const std::vector<SharedView>& views, const std::vector<ThinCut>& cuts) {
  std::set<std::size_t> across;
  for (const ThinCut& cut : cuts) {
    const std::set<PoseIndex> beyond(cut.beyond.begin(), cut.beyond.end());
    for (const SharedView& view : views) {
      for (const TagInView* tag : fewer_across(view, beyond))
        across.insert(tag->terms.begin(), tag->terms.end());
    }
  }
  return across;
}

/// Removes the cuts that motion, priors or distances can check. These may not depend on the observations of
/// other cuts either. `across`: the corner terms of all cuts.
void remove_checked(Bundle& bundle, const BundleCovariance& P, const std::set<std::size_t>& across,
                    std::vector<ThinCut>& cuts) {
  for (const std::size_t term : across) bundle.corners[term].used = false;
  const BundleCovariance without = covariance(bundle);
  for (const std::size_t term : across) bundle.corners[term].used = true;
  std::erase_if(cuts, [&](ThinCut& cut) { return !is_unchecked(bundle, P, without, cut); });
}

}  // namespace

std::vector<ThinCut> unchecked_cuts(Bundle& bundle, const BundleCovariance& P, const std::vector<char>& moves,
                                    const std::set<PoseIndex>& roots) {
  const bool motion = has_motion(bundle);
  const bool given = has_given_ties(bundle, roots);
  const auto found = [&](ImageTies ties) { return thin_cuts(bundle, moves, roots, ties); };
  std::vector<ThinCut> beside_motion = motion ? found(ImageTies::Moving) : std::vector<ThinCut>();
  const std::set<std::size_t> kept = terms_across(views_of(bundle, moves, ImageTies::Moving), beside_motion);
  if (given && !beside_motion.empty()) remove_checked(bundle, P, kept, beside_motion);

  std::vector<ThinCut> cuts = found(ImageTies::Separate);
  std::erase_if(cuts, [&](const ThinCut& cut) {
    return std::ranges::find(beside_motion, cut.beyond, &ThinCut::beyond) != beside_motion.end();
  });
  if ((motion || given) && !cuts.empty()) {
    // Without the observations that motion does not replace, nothing would determine the other parts either.
    std::set<std::size_t> across = terms_across(views_of(bundle, moves, ImageTies::Separate), cuts);
    std::erase_if(across, [&](std::size_t term) { return kept.contains(term); });
    remove_checked(bundle, P, across, cuts);
  }
  std::ranges::move(beside_motion, std::back_inserter(cuts));
  cuts = without_nested(std::move(cuts));
  std::ranges::move(rarely_observed_tags(bundle, roots), std::back_inserter(cuts));
  return cuts;
}

std::vector<std::string> describe(const std::vector<TagCut>& cuts,
                                  const std::function<std::string(const std::vector<TagId>&)>& names) {
  constexpr std::size_t kMaxReported = 5;
  std::vector<std::string> warnings;
  std::vector<TagId> rare;
  for (const TagCut& cut : cuts) {
    if (cut.beyond.size() == 1) rare.push_back(cut.beyond.front());
    if (cut.beyond.size() == 1 || warnings.size() == kMaxReported) continue;
    const std::string observations =
        cut.observations == 1 ? "one observation" : fmt::format("{} observations", cut.observations);
    const std::string otherwise =
        cut.otherwise_sigma_m
            ? fmt::format(" (without these, their standard deviation is {:.2f} m)", *cut.otherwise_sigma_m)
            : "";
    warnings.push_back(
        fmt::format("{}: connected only by {} of {}{}; an error in these would move all of them",
                    names(cut.beyond), observations, names(cut.by), otherwise));
  }
  std::ranges::sort(rare);
  if (!rare.empty())
    warnings.push_back(fmt::format("{}: at most two observations in use{}; an error in these would move {}",
                                   names(rare), rare.size() == 1 ? "" : " each",
                                   rare.size() == 1 ? "it" : "them"));
  return warnings;
}

}  // namespace waymark
