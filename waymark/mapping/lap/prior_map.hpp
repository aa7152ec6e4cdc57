#pragma once

#include <map>
#include <string>
#include <vector>

#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/mapping/lap/map_comparison.hpp"
#include "waymark/mapping/lap/tag_ties.hpp"
#include "waymark/mapping/solver/bundle.hpp"

/// Ties a lap to an existing map, and determines which of the map's tags are unmoved.
namespace waymark::internal {

/// Covariance of each tag's pose (left tangent in the map) due to misplaced corners, caused by inaccurate
/// printing, inaccurate mounting and the systematic error of the detector. Each corner is displaced by
/// `sigma_m` along both axes of the tag, equally in all images, so these errors do not average out. At the
/// current robot and camera poses, this is the first-order error of a fit with a wrong model (Huber, "The
/// Behavior of Maximum Likelihood Estimates under Nonstandard Conditions", 5th Berkeley Symposium, 1967). It
/// is A^-1 B sigma^2 B^T A^-T, where A is the information of the tag's corners and B contains the derivatives
/// of the corners with respect to the displacements. Tags without an observation in use are omitted.
/// O(observations).
[[nodiscard]] std::map<PoseIndex, Matrix6> covariance_of_print(const Bundle& bundle, double sigma_m);

/// Lower bound for the common error of those tags in a map that are not tied to another tag. It is a matrix
/// that is not larger than any of their covariances; in their common left tangent, a motion of the whole map
/// is the same for all tags. Zero if a tag is exact. The matrix is computed tag by tag: A = S S^T and B = S D
/// S^T are replaced with S min(I, D) S^T. O(tags).
[[nodiscard]] Matrix6 common_covariance(const TagMap& map);

struct TiedPrior {
  std::map<TagId, PoseIndex> before{};  ///< poses of the tags of the prior map, as currently estimated
  MapComparison comparison{};
  std::vector<TagId> agreeing{};
  std::vector<TagId> moved{};
  std::set<TagId> untied{};             ///< tags of the prior map that are inconsistent with all others
  std::vector<std::string> warnings{};  ///< warnings about tags that are not at their pose in the prior map
};

/// Aligns the lap with the prior map using the alignment that most tags agree on, unless the lap's anchor is
/// still at its pose there. Then adds the information from the prior map. For a tied tag, this is its
/// conditional information given the tag to which it is tied. Untied tags are given a common error of the
/// whole map plus an individual one. An unmoved tag has one pose in the bundle; the old pose of a moved tag
/// stays in the bundle for the tags tied to it. Frozen tags and exact tags of the prior map are fixed.
/// `known`: covariance of the lap on its own. Fails if fewer than two tags agree.
[[nodiscard]] Result<TiedPrior> tie_to_prior(const LapPrior& prior, const TagId& anchor,
                                             const BundleCovariance& known, LapBundle& lap);

/// Pairs of tags that may be tied, and the indices of their poses.
struct TiePairs {
  TagPairs tags{};
  std::vector<std::pair<PoseIndex, PoseIndex>> poses{};
};

/// Pairs of tags that are not fixed, from the lap and from the map that it extends, if any.
[[nodiscard]] TiePairs pairs_to_tie(const LapInput& input, const LapBundle& lap,
                                    const std::optional<TiedPrior>& tied);

/// Whether each tag was measured individually. A map made from laps contains an exact anchor and ties
/// instead.
[[nodiscard]] bool is_measured(const TagMap& map);

/// Whether a tag in the prior map is fixed.
[[nodiscard]] bool is_held(const LapPrior& prior, const TagId& tag, const MappedTag& mapped);

[[nodiscard]] bool is_unmoved(const MapComparison& comparison, const TagId& tag);

/// Finds the tags whose poses agree between the lap on its own and the prior map; the others were moved or
/// swapped. `now` contains the tags that the lap observed.
/// - For a map made from laps, the uncertainties of both poses are decisive. Both poses have the print errors
/// of the tags, and both maps share an anchor.
/// - For a measured map, the comparison of the aligned maps is approximate, because an inaccurate print of
/// the anchor tilts the lap. `revise_agreement` repeats the decision later.
void find_agreeing(const LapPrior& prior, const TagMap& now, const LapBundle& lap, const TagId& anchor,
                   const BundleCovariance& known, TiedPrior& tied);

/// Repeats the decision after a bundle that is tied to a measured map has been solved. Tags that appeared to
/// have moved may agree now, because tied tags near them are at their old poses; they are then tied as well.
/// If there is no such tag, the tag that the lap and all other tags place farthest from its old pose is
/// untied permanently (deleted residual; Cook and Weisberg, "Residuals and Influence in Regression", 1982,
/// section 2.2), if the distance exceeds both uncertainties. Returns false if nothing changed. Otherwise the
/// bundle must be solved again, at most twice for each tag. The distances in TiedPrior::warnings are those at
/// the poses at the time of the call.
[[nodiscard]] bool revise_agreement(const LapPrior& prior, LapBundle& lap, TiedPrior& tied);

}  // namespace waymark::internal
