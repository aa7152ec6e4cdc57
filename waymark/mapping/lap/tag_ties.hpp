#pragma once

#include <utility>
#include <vector>

#include "waymark/mapping/lap/lap_bundle.hpp"

/// How the errors of a map's tags hang together: each tag is tied to one other by the covariance of the two,
/// so that the whole is a tree. Of all trees the one of the pairs that tell most of each other is nearest to
/// the true joint distribution (Chow and Liu, "Approximating Discrete Probability Distributions with
/// Dependence Trees", IEEE Trans. Information Theory 14(3), 1968, section II), and along its branches nothing
/// is lost.
namespace waymark {

/// Takes a tag out of a map. What was tied to it is tied to what it was tied to, or to each other.
void remove_tag(TagMap& map, const TagId& tag);

namespace internal {

using TagPairs = std::vector<std::pair<TagId, TagId>>;

/// Tags that many frames saw together, each with some, and those that the map that is extended has tied.
[[nodiscard]] TagPairs tie_candidates(const LapInput& input, const LapBundle& lap);

/// Ties tags of a map that have covariances by the best tree of pairs; `covariances` (row: first tag, column:
/// second) of each pair. O(pairs log pairs).
void tie_tags(const TagPairs& pairs, const std::vector<Matrix6>& covariances, TagMap& map);

/// What a tag's error is, given that of the tag it is tied to: gain * that, and the rest.
struct TiedError {
  Matrix6 gain = Matrix6::Zero();
  Matrix6 covariance = Matrix6::Zero();
};
/// Both tags must have covariances.
[[nodiscard]] TiedError tied_error(const MappedTag& tag, const MappedTag& to);

}  // namespace internal
}  // namespace waymark
