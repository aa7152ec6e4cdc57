#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/families/family.hpp"
#include "waymark/mapping/solver/bundle.hpp"

/// Parts of a map that depend on few observations. If one of these is wrong, such as a misread id, nothing
/// contradicts it, and the whole part is displaced.
namespace waymark {

/// Tags that are connected to the rest by so few observations that one wrong observation would move them all.
struct ThinCut {
  std::vector<PoseIndex> beyond{};  ///< tags, ascending
  std::vector<PoseIndex> by{};      ///< the tags whose observations connect them, ascending
  int observations = 0;             ///< number of observations of those tags
  /// Standard deviation of the positions beyond without these observations, by motion, priors or distances
  /// [m]. Empty if nothing else connects the tags.
  std::optional<double> otherwise_sigma_m{};
};

/// The same with the ids of the tags.
struct TagCut {
  std::vector<TagId> beyond{};  ///< the weakly connected tags, ascending
  std::vector<TagId> by{};      ///< the tags whose observations connect them, ascending
  int observations = 0;
  std::optional<double> otherwise_sigma_m{};  ///< see ThinCut
};

/// Which images connect the tags that they show.
enum class ImageTies : std::uint8_t {
  Separate,  ///< each image connects its tags only
  Moving,    ///< measured motion makes one large image of those that it connects
};

/// Finds parts of at least two tags that are connected to the rest by at most `most` observations in use,
/// sorted by size with the largest first. No part is contained in another one with the same number of
/// observations. `moves`: for each pose, whether it belongs to a single frame. `roots`: tags that are never
/// beyond a cut. Candidates are the edges of a maximum spanning tree of the tags, weighted by the number of
/// common views. O(observations * tags per view), and O(tags) per cut.
[[nodiscard]] std::vector<ThinCut> thin_cuts(const Bundle& bundle, const std::vector<char>& moves,
                                             const std::set<PoseIndex>& roots,
                                             ImageTies ties = ImageTies::Separate, int most = 3);

/// The tags with at most `most` observations in use, except for `roots`.
[[nodiscard]] std::vector<ThinCut> rarely_observed_tags(const Bundle& bundle,
                                                        const std::set<PoseIndex>& roots, int most = 2);

/// The thin cuts of a map, with motion and without, except for those that motion, priors and distances check,
/// and the rarely observed tags. A cut is not checked if the variance of a position beyond it would be more
/// than twice as large without its observations. A wrong observation that no gate rejects then moves the tags
/// by more than five standard deviations. `P`: covariance of the bundle. Costs at most two more covariance()
/// if there are cuts and such ties. The bundle is the same before and after.
[[nodiscard]] std::vector<ThinCut> unchecked_cuts(Bundle& bundle, const BundleCovariance& P,
                                                  const std::vector<char>& moves,
                                                  const std::set<PoseIndex>& roots);

/// One warning per cut, at most five, and one for all rarely observed tags. `names`: of several tags.
[[nodiscard]] std::vector<std::string> describe(
    const std::vector<TagCut>& cuts, const std::function<std::string(const std::vector<TagId>&)>& names);

}  // namespace waymark
