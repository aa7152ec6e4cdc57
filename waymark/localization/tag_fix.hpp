#pragma once

#include <optional>
#include <span>

#include "waymark/localization/method.hpp"
#include "waymark/localization/observation.hpp"
#include "waymark/localization/watches.hpp"

namespace waymark {

/// Finds the pose on the floor that best fits the tags in one image, starting at `near`, by robust
/// Gauss-Newton iteration with Student weights (Lange, Little and Taylor, "Robust Statistical Modeling Using
/// the t Distribution", JASA 84(408), 1989). The covariance includes the lasting errors of the mapped tags
/// relative to their neighbours and a robot tilt of one degree. It does not include errors that nearby tags
/// have in common, because fixes are compared with each other. Returns `nullopt` if the search does not
/// converge or the standard deviation of the position exceeds `most_sigma_m`. Tags under suspicion are used
/// if the image contains no others, because a tag that was once moved but is now fixed still shows the
/// robot's motion. Does not allocate.
[[nodiscard]] std::optional<TagFix> fix_of(std::span<const Observation> seen, const Landmarks& landmarks,
                                           const TagWatch& watch, const MountedSensor& sensor,
                                           const RiekfOptions& options, const SE2& near,
                                           double most_sigma_m = 0.15);

}  // namespace waymark
