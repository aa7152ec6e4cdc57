#include "waymark/mapping/lap/tag_ties.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Cholesky>

namespace waymark {
namespace {

const Matrix6 kSlack = 1e-12 * Matrix6::Identity();

double log_determinant(const Matrix6& P) {
  const Eigen::LLT<Matrix6> llt(P);
  if (llt.info() != Eigen::Success) return -1e3;
  return 2 * llt.matrixLLT().diagonal().array().log().sum();
}

/// The gain C P^-1.
Matrix6 gain_of(const Matrix6& C, const Matrix6& P) {
  return (P + kSlack).llt().solve(C.transpose()).transpose();
}

/// Mutual information between two tags [nat].
double mutual_information(const Matrix6& P_a, const Matrix6& P_b, const Matrix6& P_ab) {
  const Matrix6 rest = P_a - gain_of(P_ab, P_b) * P_ab.transpose() + kSlack;
  return (log_determinant(P_a + kSlack) - log_determinant(rest)) / 2;
}

struct TieBranch {
  TagId a{}, b{};
  Matrix6 covariance = Matrix6::Zero();  ///< rows: a, columns: b
  double information = 0;
};

/// The branches of the tree with the largest mutual information (Kruskal).
std::vector<TieBranch> best_tree(std::vector<TieBranch> branches) {
  std::ranges::stable_sort(branches, std::greater<>{}, &TieBranch::information);
  std::map<TagId, TagId> above;
  const auto root = [&](TagId tag) {
    while (true) {
      const TagId next = above.try_emplace(tag, tag).first->second;
      if (next == tag) return tag;
      tag = above[tag] = above.try_emplace(next, next).first->second;
    }
  };
  std::vector<TieBranch> tree;
  for (TieBranch& branch : branches) {
    const TagId a = root(branch.a);
    const TagId b = root(branch.b);
    if (a == b) continue;
    above[a] = b;
    tree.push_back(std::move(branch));
  }
  return tree;
}

}  // namespace

void remove_tag(TagMap& map, const TagId& removed) {
  const auto found = map.tags.find(removed);
  if (found == map.tags.end()) return;
  const MappedTag gone = found->second;
  map.tags.erase(found);
  // The tie between the removed tag and the new parent of its children.
  std::optional<TagTie> instead = gone.tie;
  for (auto& [id, tag] : map.tags) {
    if (!tag.tie || tag.tie->to != removed) continue;
    const Matrix6 to_gone = tag.tie->covariance;
    if (!gone.covariance || !instead) {
      tag.tie.reset();
      if (gone.covariance) instead = TagTie{id, to_gone.transpose()};
      continue;
    }
    tag.tie = TagTie{instead->to, gain_of(to_gone, *gone.covariance) * instead->covariance};
  }
}

namespace internal {

TagPairs tie_candidates(const LapInput& input, const LapBundle& lap) {
  constexpr std::size_t kMaxPartners = 6;
  std::vector<std::vector<TagId>> of_frame(input.frames.size());
  for (std::size_t i = 0; i < lap.observations.size(); ++i) {
    const auto [frame, detection] = lap.observations[i];
    if (lap.bundle.corners[i].used) of_frame[frame].push_back(input.frames[frame].detections[detection].tag);
  }
  TagPairs together;
  for (std::vector<TagId>& tags : of_frame) {
    std::ranges::sort(tags);
    for (std::size_t a = 0; a < tags.size(); ++a) {
      for (std::size_t b = a + 1; b < tags.size(); ++b) {
        if (tags[a] != tags[b]) together.emplace_back(tags[a], tags[b]);
      }
    }
  }
  std::ranges::sort(together);
  std::map<TagId, std::vector<std::pair<std::ptrdiff_t, TagId>>> partners;
  for (auto first = together.begin(); first != together.end();) {
    const auto last = std::upper_bound(first, together.end(), *first);
    partners[first->first].emplace_back(last - first, first->second);
    partners[first->second].emplace_back(last - first, first->first);
    first = last;
  }
  TagPairs pairs;
  for (auto& [tag, list] : partners) {
    std::ranges::sort(list, std::greater<>{});
    list.resize(std::min(list.size(), kMaxPartners));
    for (const auto& [count, other] : list) pairs.push_back(std::minmax(tag, other));
  }
  if (input.prior) {
    for (const auto& [id, tag] : input.prior->map.tags) {
      if (tag.tie) pairs.push_back(std::minmax(id, tag.tie->to));
    }
  }
  std::ranges::sort(pairs);
  pairs.erase(std::ranges::unique(pairs).begin(), pairs.end());
  return pairs;
}

void tie_tags(const TagPairs& pairs, const std::vector<Matrix6>& covariances, TagMap& map) {
  std::vector<TieBranch> branches;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const MappedTag* a = map.find(pairs[i].first);
    const MappedTag* b = map.find(pairs[i].second);
    if (a == nullptr || b == nullptr || !a->covariance || !b->covariance) continue;
    branches.push_back({pairs[i].first, pairs[i].second, covariances[i],
                        mutual_information(*a->covariance, *b->covariance, covariances[i])});
  }
  // (other tag; rows: other tag, columns: this tag).
  std::map<TagId, std::vector<std::pair<TagId, Matrix6>>> neighbours;
  for (const TieBranch& branch : best_tree(std::move(branches))) {
    neighbours[branch.a].emplace_back(branch.b, branch.covariance.transpose());
    neighbours[branch.b].emplace_back(branch.a, branch.covariance);
  }
  std::set<TagId> reached;
  for (auto& [root, unused] : neighbours) {
    std::vector<TagId> front;
    if (reached.insert(root).second) front.push_back(root);
    while (!front.empty()) {
      const TagId here = front.back();
      front.pop_back();
      for (const auto& [other, covariance] : neighbours[here]) {
        if (!reached.insert(other).second) continue;
        map.tags.at(other).tie = TagTie{here, covariance};
        front.push_back(other);
      }
    }
  }
}

TiedError tied_error(const MappedTag& tag, const MappedTag& to) {
  TiedError tied{.gain = gain_of(tag.tie->covariance, *to.covariance)};
  tied.covariance = *tag.covariance - tied.gain * tag.tie->covariance.transpose();
  tied.covariance = ((tied.covariance + tied.covariance.transpose()) / 2).eval();
  return tied;
}

}  // namespace internal
}  // namespace waymark
