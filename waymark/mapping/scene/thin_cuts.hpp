#pragma once

#include <set>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"

/// Where a map hangs together by a few observations.
namespace waymark {

/// Tags that are tied to the rest by so few observations that a wrong one among them would move them all.
struct ThinCut {
  std::vector<PoseIndex> beyond{};  ///< tags, ascending
  std::vector<PoseIndex> by{};      ///< the tags whose observations tie them, ascending
  int observations = 0;             ///< of those tags
};

/// Cuts of at least two tags that at most `most` observations in use cross, the largest part first, none
/// within another of as many observations. `moves`: of each pose, it is of one frame; `root` is never beyond
/// a cut. Candidates are the edges of a maximum spanning tree of the tags by how often they are seen
/// together; motion that was measured ties frames, so with it there is none. O(observations * tags of a
/// view), and the tags for each cut.
[[nodiscard]] std::vector<ThinCut> thin_cuts(const Bundle& bundle, const std::vector<char>& moves,
                                             const std::set<PoseIndex>& roots, int most = 3);

}  // namespace waymark
