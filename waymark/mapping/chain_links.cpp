#include "waymark/mapping/chain_links.hpp"

#include <optional>
#include <set>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace waymark::internal {
namespace {

// 0.999 quantiles of chi-square.
constexpr double kGate9 = 27.9;  // two shapes and a motion of the plane
constexpr double kAnyDistance = 1e6;

Vote<SE2> between_tags(const FloorSighting& from, const FloorSighting& to) {
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

/// Where a tag is by all known tags it was seen with.
std::optional<Uncertain<SE2>> place_of(const TagId& tag, const Links& links, const Places& places,
                                       int least_votes) {
  std::vector<Vote<SE2>> votes;
  const auto offer = [&](const TagId& from, const Uncertain<SE2>& from_X_tag) {
    const auto known = places.find(from);
    if (known == places.end()) return;
    const Uncertain<SE2> map_X_tag = compose(known->second, from_X_tag);
    votes.push_back({{map_X_tag.mean, map_X_tag.covariance.inverse()}});
  };
  for (const auto& [pair, link] : links) {
    if (link.votes < least_votes) continue;
    if (pair.second == tag) offer(pair.first, link.from_X_to);
    if (pair.first == tag) offer(pair.second, inverse(link.from_X_to));
  }
  const auto agreed = agree(votes, kAnyDistance);
  return agreed ? std::optional(agreed->value) : std::nullopt;
}

/// Of the tags that wait, the one whose place would be known best.
std::optional<std::pair<TagId, Uncertain<SE2>>> nearest_known(const std::set<TagId>& waiting,
                                                              const Links& links, const Places& places,
                                                              int least_votes) {
  std::optional<std::pair<TagId, Uncertain<SE2>>> best;
  for (const TagId& tag : waiting) {
    const auto place = place_of(tag, links, places, least_votes);
    if (place && (!best || position_variance(*place) < position_variance(best->second))) best = {tag, *place};
  }
  return best;
}

}  // namespace

Links links_of(const std::vector<FloorFrame>& frames) {
  std::map<std::pair<TagId, TagId>, std::vector<Vote<SE2>>> votes;
  for (const FloorFrame& frame : frames) {
    for (const FloorSighting& from : frame.tags) {
      for (const FloorSighting& to : frame.tags) {
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
  std::set<TagId> waiting;
  for (const auto& [pair, link] : links) waiting.insert({pair.first, pair.second});
  waiting.erase(anchor);
  Places places = {{anchor, {map_X_anchor}}};
  while (true) {
    std::optional<std::pair<TagId, Uncertain<SE2>>> best;
    for (int least_votes : {10, 3, 1}) {
      if (!best) best = nearest_known(waiting, links, places, least_votes);
    }
    if (!best) return places;
    places.insert(*best);
    waiting.erase(best->first);
  }
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
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
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
        H.block<3, 3>(a->second, a->second) += JWJ;
        g.segment<3>(a->second) -= JWr;
      }
      if (b != column.end()) {
        H.block<3, 3>(b->second, b->second) += JWJ;
        g.segment<3>(b->second) += JWr;
      }
      if (a != column.end() && b != column.end()) {
        H.block<3, 3>(a->second, b->second) -= JWJ;
        H.block<3, 3>(b->second, a->second) -= JWJ;
      }
    }
    const Eigen::VectorXd step = H.ldlt().solve(g);
    for (const auto& [tag, at] : column) {
      SE2& map_X_tag = places.at(tag).mean;
      map_X_tag = plus(SE2::Tangent(step.segment<3>(at)), map_X_tag);
    }
    if (step.squaredNorm() < 1e-20) return;
  }
}

}  // namespace waymark::internal
