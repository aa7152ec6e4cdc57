#pragma once

#include <utility>
#include <vector>

#include "waymark/mapping/lap/lap_bundle.hpp"

/// Correlations between the errors of a map's tags. Each tag is tied to one other tag by their
/// cross-covariance, so the ties form a tree. The tree of the pairs with the largest mutual information is
/// closest to the true joint distribution (Chow and Liu, "Approximating Discrete Probability Distributions
/// with Dependence Trees", IEEE Trans. Information Theory 14(3), 1968, section II). Along its branches, the
/// covariance is exact.
namespace waymark {

/// Removes a tag from a map. Tags that were tied to it are then tied to the tag that it was tied to, or to
/// each other.
void remove_tag(TagMap& map, const TagId& tag);

namespace internal {

using TagPairs = std::vector<std::pair<TagId, TagId>>;

/// Pairs of tags that are seen together in many frames (a few pairs for each tag), and the pairs that are
/// tied in the map to be extended.
[[nodiscard]] TagPairs tie_candidates(const LapInput& input, const LapBundle& lap);

/// Ties those tags of a map that have covariances, using the best tree of pairs. `covariances`:
/// cross-covariance of each pair (rows: first tag, columns: second tag). O(pairs log pairs).
void tie_tags(const TagPairs& pairs, const std::vector<Matrix6>& covariances, TagMap& map);

/// The error of a tag given the error of the tag to which it is tied. It is gain * (the other tag's error)
/// plus noise with this covariance.
struct TiedError {
  Matrix6 gain = Matrix6::Zero();
  Matrix6 covariance = Matrix6::Zero();
};
/// Computes this for a tied tag. Both tags must have covariances.
[[nodiscard]] TiedError tied_error(const MappedTag& tag, const MappedTag& to);

}  // namespace internal
}  // namespace waymark
