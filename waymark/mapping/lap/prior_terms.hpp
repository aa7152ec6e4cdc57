#pragma once

#include <string>
#include <vector>

#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/mapping/lap/map_comparison.hpp"
#include "waymark/mapping/lap/tag_ties.hpp"

/// A lap tied to the map that is there already.
namespace waymark::internal {

/// What the errors of all tags of a map that are tied to no other share, at least: a matrix that is not
/// larger than any of their covariances (in their common left tangent a motion of the whole map is the same
/// for all). Zero when a tag is known exactly. From tag to tag, A = S S^T and B = S D S^T become S min(I, D)
/// S^T. O(tags).
[[nodiscard]] Matrix6 common_covariance(const TagMap& map);

struct TiedPrior {
  std::map<TagId, PoseIndex> before{};  ///< where the tags of the prior map were, as known now
  MapComparison comparison{};
  std::vector<TagId> agreeing{};
  std::vector<TagId> moved{};
  std::set<TagId> untied{};          ///< of these: contradicted by all others
  std::vector<std::string> words{};  ///< of tags that are not where the prior map has them
};

/// Moves the lap, unless its anchor still stands where the prior map has it, by what most tags agree on, and
/// adds what the prior map knows of its tags: of each what the tag it is tied to tells, and the rest; of
/// those that are tied to none a common error of the whole map, and each tag's own beside it. A tag that
/// still stands where it was is where it was; of the others the old place stays in the bundle, for what is
/// tied to it. Frozen tags, and those the prior map knows exactly, are held. `known` is what the lap by
/// itself knows. Fails when fewer than two tags agree.
[[nodiscard]] Result<TiedPrior> tie_to_prior(const LapPrior& prior, const TagId& anchor,
                                             const BundleCovariance& known, LapBundle& lap);

/// Tags that may be tied to each other, and where they are in the bundle.
struct TiePairs {
  TagPairs tags{};
  std::vector<std::pair<PoseIndex, PoseIndex>> poses{};
};

/// Of the tags of the lap and, where there is one, of the map that it extends, those that are not held.
[[nodiscard]] TiePairs pairs_to_tie(const LapInput& input, const LapBundle& lap,
                                    const std::optional<TiedPrior>& tied);

}  // namespace waymark::internal
