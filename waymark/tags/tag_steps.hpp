#pragma once

#include "waymark/tags/tag_fit.hpp"

namespace waymark::refinement {

inline constexpr double kSettledPx =
    0.02;  ///< a step after which the next one is far below what noise allows

/// Gauss-Newton on the pixels as they are; `found`: the place is known, what does not fit is left out at
/// once.
[[nodiscard]] Look iterate(bool found, TagFit& fit);

}  // namespace waymark::refinement
