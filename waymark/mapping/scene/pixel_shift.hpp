#pragma once

#include <optional>

#include "waymark/mapping/solver/bundle.hpp"

namespace waymark {

/// The largest movement [px] of a corner in use if this pose had another value; empty if no corner in use
/// depends on it.
[[nodiscard]] std::optional<double> largest_shift_px(const Bundle& bundle, PoseIndex pose, const SE3& other);

}  // namespace waymark
