#pragma once

#include <map>
#include <string>
#include <vector>

#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/mapping/lap/map_comparison.hpp"
#include "waymark/mapping/lap/tag_ties.hpp"
#include "waymark/mapping/solver/bundle.hpp"

/// A lap tied to the map that is there already, and which of its tags stand where that map has them.
namespace waymark::internal {

/// Of each tag's pose (left tangent in the map), by how much it is off because its corners are not printed
/// and glued where they should be, and because a detector sees them all aside: each corner by `sigma_m` along
/// either side of the tag, the same in all pictures, which therefore do not average it away. What a fit with
/// a wrong model estimates, to first order: A^-1 B sigma^2 B^T A^-T, A the information of the tag's corners,
/// B their derivatives by the errors (Huber, "The Behavior of Maximum Likelihood Estimates under Nonstandard
/// Conditions", 5th Berkeley Symposium, 1967), with robot and camera where they stand. Tags without an
/// observation in use are left out. O(observations).
[[nodiscard]] std::map<PoseIndex, Matrix6> covariance_of_print(const Bundle& bundle, double sigma_m);

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

/// Whether each of its tags was measured by itself: a map that was made from laps has an anchor that is known
/// exactly, and ties.
[[nodiscard]] bool is_measured(const TagMap& map);

/// Whether a tag of the prior map does not move.
[[nodiscard]] bool is_held(const LapPrior& prior, const TagId& tag, const MappedTag& mapped);

[[nodiscard]] bool stands_where_it_was(const MapComparison& comparison, const TagId& tag);

/// The tags whose places in the lap by itself and in the prior map are one place; the others were moved, or
/// swapped. `now` has the tags that the lap saw. Of a map from laps, as far as the two know: both are off by
/// what is wrong with the tags' print, and stand on one anchor. Of a measured map, roughly, as the two are
/// aligned: how the anchor is printed tilts the lap that stands on it; `revise_agreement` asks again.
void find_agreeing(const LapPrior& prior, const TagMap& now, const LapBundle& lap, const TagId& anchor,
                   const BundleCovariance& known, TiedPrior& tied);

/// Asks anew once the bundle is solved that is tied to a map that was measured. What is beside tied tags is
/// where it was, so that tags taken for moved may agree now: they are tied as well. Where none does, the tag
/// is untied, for good, that is farthest from where the lap and all other tags have it (the residual without
/// its own datum: Cook and Weisberg, "Residuals and Influence in Regression", 1982, section 2.2), if farther
/// than both can be wrong by. False where nothing changed; else the bundle is to be solved again, at most
/// twice for each tag. TiedPrior::words say how far tags are by where the poses are when it is called.
[[nodiscard]] bool revise_agreement(const LapPrior& prior, LapBundle& lap, TiedPrior& tied);

}  // namespace waymark::internal
