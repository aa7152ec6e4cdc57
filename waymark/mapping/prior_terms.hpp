#pragma once

#include <string>
#include <vector>

#include "waymark/mapping/lap_bundle.hpp"
#include "waymark/mapping/map_comparison.hpp"

/// A lap tied to the map that is there already.
namespace waymark::internal {

/// What the errors of all tags of a map share, at least: a matrix that is not larger than any of their
/// covariances (in their common left tangent a motion of the whole map is the same for all). Zero when a tag
/// is known exactly. From tag to tag, A = S S^T and B = S D S^T become S min(I, D) S^T. O(tags).
[[nodiscard]] Matrix6 common_covariance(const TagMap& map);

struct TiedPrior {
  PoseIndex old = 0;  ///< where the frame of the prior map lies in the map
  Matrix6 common = Matrix6::Zero();
  MapComparison comparison{};
  std::vector<TagId> agreeing{};
  std::vector<std::string> words{};  ///< of tags that are not where the prior map has them
};

/// Moves the lap, unless its anchor still stands where the prior map has it, by what most tags agree on, and
/// adds what the prior map knows of each of its tags that still stands where it was: a common error of the
/// whole map, and each tag's own beside it. Frozen tags, and those the prior map knows exactly, are held.
/// `known` is what the lap by itself knows. Fails when fewer than two tags agree.
[[nodiscard]] Result<TiedPrior> tie_to_prior(const LapPrior& prior, const TagId& anchor,
                                             const BundleCovariance& known, LapBundle& lap);

/// A tag of the prior map that the lap did not see, after the lap.
[[nodiscard]] MappedTag unseen_tag(const LapPrior& prior, const TagId& tag, const TiedPrior& tied,
                                   const Bundle& bundle, const BundleCovariance& P);

}  // namespace waymark::internal
