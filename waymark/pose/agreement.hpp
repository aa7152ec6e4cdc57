#pragma once

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/uncertainty.hpp"

/// Determines one value from many measurements, each with several alternatives, at most one of which is
/// correct.
namespace waymark::internal {

/// Poses closer to each other than this agree: the 0.999 quantile of chi-square with 6 degrees of freedom.
inline constexpr double kPoseGate = 22.5;

/// One candidate for a transform, obtained from one frame.
template <LieGroup G>
struct Alternative {
  G value{};
  typename G::Jacobian information =
      G::Jacobian::Identity();  ///< inverse covariance in the left tangent; may be singular
  double chi2 = 0;              ///< chi2 of this alternative by itself
};

/// The alternatives of one frame.
template <LieGroup G>
using Vote = std::vector<Alternative<G>>;

template <LieGroup G>
struct Agreement {
  Uncertain<G> value{};
  int votes = 0;  ///< number of votes that agree with the value
};

template <LieGroup G>
double distance2(const Alternative<G>& alternative, const G& value) {
  const typename G::Tangent r = minus(alternative.value, value);
  return r.dot(alternative.information * r);
}

/// The alternative of a vote that is nearest to a value, with its distance; nullptr if it is beyond the gate.
template <LieGroup G>
std::pair<const Alternative<G>*, double> nearest(const Vote<G>& vote, const G& value, double gate) {
  std::pair<const Alternative<G>*, double> best{nullptr, gate};
  for (const Alternative<G>& alternative : vote) {
    const double chi2 = alternative.chi2 + distance2(alternative, value);
    if (chi2 < best.second) best = {&alternative, chi2};
  }
  return best;
}

template <LieGroup G>
double cost_of(const std::vector<Vote<G>>& votes, const G& value, double gate) {
  double sum = 0;
  for (const Vote<G>& vote : votes) sum += nearest(vote, value, gate).second;
  return sum;
}

/// The proposal with the smallest total cost over the votes. The proposals are all alternatives of the
/// best-determined votes.
template <LieGroup G>
std::optional<G> propose(const std::vector<Vote<G>>& votes, double gate) {
  constexpr std::size_t kProposers = 8;
  std::vector<std::size_t> order(votes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto weight = [&](std::size_t i) {
    return votes[i].empty() ? -1 : votes[i].front().information.trace();
  };
  std::ranges::stable_sort(order, std::greater<>{}, weight);
  std::optional<G> best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < std::min(kProposers, order.size()); ++k) {
    for (const Alternative<G>& alternative : votes[order[k]]) {
      const double cost = cost_of(votes, alternative.value, gate);
      if (cost < least) {
        least = cost;
        best = alternative.value;
      }
    }
  }
  return best;
}

/// The weighted mean of the alternatives that agree, using at most one per vote and none beyond the gate.
/// Poses are fused by Gauss-Newton iteration, starting near the mean (Barfoot and Furgale, "Associating
/// Uncertainty with Three-Dimensional Poses for Use in Estimation Problems", IEEE T-RO 30(3), 2014, section
/// IV).
template <LieGroup G>
std::optional<Agreement<G>> agree_near(const std::vector<Vote<G>>& votes, const G& start, double gate) {
  constexpr int kIterations = 20;
  G value = start;
  Agreement<G> result;
  for (int i = 0; i < kIterations; ++i) {
    typename G::Jacobian H = G::Jacobian::Identity() * 1e-9;  // directions without information do not change
    typename G::Tangent g = G::Tangent::Zero();
    double chi2 = 0;
    result.votes = 0;
    for (const Vote<G>& vote : votes) {
      const auto [alternative, cost] = nearest(vote, value, gate);
      if (alternative == nullptr) continue;
      H += alternative->information;
      g += alternative->information * minus(alternative->value, value);
      chi2 += distance2(*alternative, value);
      ++result.votes;
    }
    if (result.votes == 0) return std::nullopt;
    const typename G::Jacobian covariance = H.llt().solve(G::Jacobian::Identity());
    const typename G::Tangent step = covariance * g;
    value = plus(step, value);
    const double scatter = chi2 / std::max(1, G::kDof * (result.votes - 1));
    result.value = {value, covariance * std::max(1.0, scatter)};
    if (step.squaredNorm() < 1e-24) break;
  }
  return result;
}

/// The value on which the votes agree. All votes together determine which alternative is used for each vote.
template <LieGroup G>
std::optional<Agreement<G>> agree(const std::vector<Vote<G>>& votes, double gate) {
  const std::optional<G> start = propose(votes, gate);
  return start ? agree_near(votes, *start, gate) : std::nullopt;
}

}  // namespace waymark::internal
