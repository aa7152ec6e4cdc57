#pragma once

#include <utility>
#include <vector>

namespace waymark::internal {

/// The unknowns of a symmetric block system in the order in which they should be eliminated. `couplings`:
/// pairs of different unknowns that share a residual, each of them once.
///
/// The order is of approximate minimum degree (Amestoy, Davis and Duff, SIAM J. Matrix Anal. Appl. 17(4),
/// 1996). That algorithm puts unknowns with very many couplings last and ignores them otherwise. What is left
/// of a long drive past the same tags is a chain, in which all unknowns have the same degree. Eliminated from
/// one end to the other, it would couple each pose to all tags seen before it. If most unknowns are in
/// chains, these are therefore eliminated in rounds, each of which takes every second unknown (Liu,
/// "Modification of the Minimum-Degree Algorithm by Multiple Elimination", ACM TOMS 11(2), 1985). Each pose
/// is then coupled to few tags. O(couplings * log(unknowns)) for chains.
[[nodiscard]] std::vector<int> elimination_order(int unknowns,
                                                 const std::vector<std::pair<int, int>>& couplings);

}  // namespace waymark::internal
