#pragma once

#include <vector>

#include "waymark/mapping/solver/block_system.hpp"

namespace waymark::internal {

/// In which order the unknowns of a symmetric system by blocks are eliminated, and which of them together:
/// fronts, small dense matrices that hand what is left over to their parent (Liu, "The Multifrontal Method
/// for Sparse Matrix Solution: Theory and Practice", SIAM Review 34(1), 1992).
struct FrontPlan {
  struct Front {
    std::vector<int> unknowns{};  ///< those eliminated here, then those coupled to them that are later
    std::vector<int> offsets{};   ///< of each: its first scalar in the front
    int own = 0;                  ///< so many of the unknowns are eliminated here
    int own_size = 0, size = 0;   ///< scalars
    int parent = -1;
    bool first_child = false;  ///< of its parent, in the order of the fronts
  };
  std::vector<Front> fronts{};  ///< children before their parents, the heaviest child of each first
  std::vector<int> front_of{};  ///< where each unknown is eliminated
};

/// Approximate minimum degree by blocks (Amestoy, Davis and Duff, SIAM J. Matrix Anal. Appl. 17(4), 1996);
/// fronts that would hand on nearly all they hold are eliminated with their parent. O(entries of the factor).
[[nodiscard]] FrontPlan front_plan(const BlockSystem& system);

}  // namespace waymark::internal
