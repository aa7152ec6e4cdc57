#include "waymark/mapping/lap/chain_links.hpp"

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

namespace waymark::internal {
namespace {

// 0.999 quantiles of chi-square.
constexpr double kGate9 = 27.9;  // two shapes and a motion of the plane
constexpr double kAnyDistance = 1e6;

Vote<SE2> between_tags(const FloorObservation& from, const FloorObservation& to) {
  Vote<SE2> vote;
  for (const FloorFit& base_X_from : from.base_X_tag) {
    for (const FloorFit& base_X_to : to.base_X_tag) {
      const Uncertain<SE2> from_X_to = between(base_X_from.a_X_b, base_X_to.a_X_b);
      vote.push_back({from_X_to.mean, from_X_to.covariance.inverse(), base_X_from.chi2 + base_X_to.chi2});
    }
  }
  return vote;
}

double position_variance(const Uncertain<SE2>& map_X_tag) {
  return coordinate_covariance(map_X_tag).topLeftCorner<2, 2>().trace();
}

/// The links of one tag, each as the motion from the other tag to it.
struct Neighbour {
  TagId other{};
  Uncertain<SE2> other_X_tag{};
  int votes = 0;
};
using Neighbours = std::map<TagId, std::vector<Neighbour>>;

Neighbours neighbours_of(const Links& links) {
  Neighbours neighbours;
  for (const auto& [pair, link] : links) {
    neighbours[pair.second].push_back({pair.first, link.from_X_to, link.votes});
    neighbours[pair.first].push_back({pair.second, inverse(link.from_X_to), link.votes});
  }
  return neighbours;
}

/// Where a tag is by all known tags it was seen with.
std::optional<Uncertain<SE2>> place_of(const std::vector<Neighbour>& neighbours, const Places& places,
                                       int least_votes) {
  std::vector<Vote<SE2>> votes;
  for (const Neighbour& neighbour : neighbours) {
    const auto known = places.find(neighbour.other);
    if (neighbour.votes < least_votes || known == places.end()) continue;
    const Uncertain<SE2> map_X_tag = compose(known->second, neighbour.other_X_tag);
    votes.push_back({{map_X_tag.mean, map_X_tag.covariance.inverse()}});
  }
  const auto agreed = agree(votes, kAnyDistance);
  return agreed ? std::optional(agreed->value) : std::nullopt;
}

/// A tag that waits for its place: where it would be, by links of so many votes and more.
struct Waiting {
  std::array<std::optional<Uncertain<SE2>>, 3> place{};
  std::array<double, 3> variance{};
};
constexpr std::array<int, 3> kLeastVotes = {10, 3, 1};

void look_again(const std::vector<Neighbour>& neighbours, const Places& places, Waiting& waiting) {
  for (std::size_t i = 0; i < kLeastVotes.size(); ++i) {
    waiting.place[i] = place_of(neighbours, places, kLeastVotes[i]);
    if (waiting.place[i]) waiting.variance[i] = position_variance(*waiting.place[i]);
  }
}

/// Of the tags that wait, the one whose place would be known best, by the most voted links there are.
std::optional<std::pair<TagId, Uncertain<SE2>>> nearest_known(const std::map<TagId, Waiting>& all) {
  for (std::size_t i = 0; i < kLeastVotes.size(); ++i) {
    const std::pair<const TagId, Waiting>* best = nullptr;
    for (const auto& entry : all) {
      const Waiting& waiting = entry.second;
      if (waiting.place[i] && (best == nullptr || waiting.variance[i] < best->second.variance[i]))
        best = &entry;
    }
    if (best != nullptr) return std::pair(best->first, *best->second.place[i]);
  }
  return std::nullopt;
}

}  // namespace

std::vector<Vote<SE2>> votes_for_base(const FloorFrame& frame, const Places& places,
                                      const Eigen::Matrix3d& noise) {
  std::vector<Vote<SE2>> votes;
  for (const FloorObservation& seen : frame.tags) {
    const auto place = places.find(seen.tag);
    if (place == places.end()) continue;
    Vote<SE2> vote;
    for (const FloorFit& base_X_tag : seen.base_X_tag) {
      Uncertain<SE2> tag_X_base = inverse(base_X_tag.a_X_b);
      tag_X_base.covariance += noise;
      const Uncertain<SE2> map_X_base = compose(Uncertain<SE2>{place->second.mean}, tag_X_base);
      vote.push_back({map_X_base.mean, map_X_base.covariance.inverse(), base_X_tag.chi2});
    }
    votes.push_back(std::move(vote));
  }
  return votes;
}

Links links_of(const std::vector<FloorFrame>& frames) {
  std::map<std::pair<TagId, TagId>, std::vector<Vote<SE2>>> votes;
  for (const FloorFrame& frame : frames) {
    for (const FloorObservation& from : frame.tags) {
      for (const FloorObservation& to : frame.tags) {
        if (from.tag < to.tag) votes[{from.tag, to.tag}].push_back(between_tags(from, to));
      }
    }
  }
  Links links;
  for (const auto& [pair, of_pair] : votes) {
    if (const auto agreed = agree(of_pair, kGate9)) links[pair] = {agreed->value, agreed->votes};
  }
  return links;
}

Places compose_from_anchor(const Links& links, const TagId& anchor, const SE2& map_X_anchor) {
  const Neighbours neighbours = neighbours_of(links);
  std::map<TagId, Waiting> waiting;  // seen with one that is placed
  Places places = {{anchor, {map_X_anchor}}};
  // Only tags seen together with the one that was placed last can be known better than before.
  const auto placed = [&](const TagId& tag) {
    const auto of_tag = neighbours.find(tag);
    if (of_tag == neighbours.end()) return;
    for (const Neighbour& neighbour : of_tag->second) {
      if (places.contains(neighbour.other)) continue;
      look_again(neighbours.at(neighbour.other), places, waiting[neighbour.other]);
    }
  };
  placed(anchor);
  while (const auto best = nearest_known(waiting)) {
    places.insert(*best);
    waiting.erase(best->first);
    placed(best->first);
  }
  return places;
}

void spread_closing_error(const Links& links, const TagId& anchor, Places& places) {
  constexpr int kIterations = 20;
  std::map<TagId, Eigen::Index> column;
  for (const auto& [tag, place] : places) {
    if (tag != anchor) column.emplace(tag, 3 * static_cast<Eigen::Index>(column.size()));
  }
  const auto size = 3 * static_cast<Eigen::Index>(column.size());
  if (size == 0) return;
  for (int i = 0; i < kIterations; ++i) {
    std::vector<Eigen::Triplet<double>> H;
    const auto add = [&](Eigen::Index row, Eigen::Index col, const Eigen::Matrix3d& block) {
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c)
          H.emplace_back(static_cast<int>(row) + r, static_cast<int>(col) + c, block(r, c));
      }
    };
    Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
    for (const auto& [pair, link] : links) {
      const auto from = places.find(pair.first);
      const auto to = places.find(pair.second);
      if (from == places.end() || to == places.end()) continue;
      const SE2 from_X_map = from->second.mean.inverse();
      const SE2::Tangent r = minus(link.from_X_to.mean, from_X_map * to->second.mean);
      const Eigen::Matrix3d W = link.from_X_to.covariance.inverse();
      const Eigen::Matrix3d Ad = from_X_map.adjoint();
      const double weight = 1 / (1 + r.dot(W * r) / 9);
      const Eigen::Matrix3d JWJ = weight * Ad.transpose() * W * Ad;
      const Eigen::Vector3d JWr = weight * Ad.transpose() * W * r;
      const auto a = column.find(pair.first);
      const auto b = column.find(pair.second);
      if (a != column.end()) {
        add(a->second, a->second, JWJ);
        g.segment<3>(a->second) -= JWr;
      }
      if (b != column.end()) {
        add(b->second, b->second, JWJ);
        g.segment<3>(b->second) += JWr;
      }
      if (a != column.end() && b != column.end()) {
        add(a->second, b->second, -JWJ);
        add(b->second, a->second, -JWJ);
      }
    }
    Eigen::SparseMatrix<double> sparse(size, size);
    sparse.setFromTriplets(H.begin(), H.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt(sparse);
    const Eigen::VectorXd step = ldlt.solve(g);
    if (ldlt.info() != Eigen::Success || !step.allFinite()) return;
    for (const auto& [tag, at] : column) {
      SE2& map_X_tag = places.at(tag).mean;
      map_X_tag = plus(SE2::Tangent(step.segment<3>(at)), map_X_tag);
    }
    if (step.squaredNorm() < 1e-20) return;
  }
}

}  // namespace waymark::internal
