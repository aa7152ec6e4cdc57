#pragma once

#include <optional>
#include <span>

#include "waymark/localization/method.hpp"
#include "waymark/localization/observation.hpp"
#include "waymark/localization/watches.hpp"

namespace waymark {

/// The pose on the floor that fits the tags of one picture best, searched from `near`: robust Gauss-Newton
/// with Student weights (Lange, Little and Taylor, "Robust Statistical Modeling Using the t Distribution",
/// JASA 84(408), 1989). Lasting errors of the mapped tags beside their neighbours and a tilt of the robot by
/// a degree are part of the covariance; what all tags around share is not: fixes are held against each other.
/// Nothing when the search does not converge, or when the tags leave the position uncertain by more than
/// `most_sigma_m`. Tags that are suspected count where a picture shows no others: what was moved and hangs
/// still shows all the same how the robot moves. No allocation.
[[nodiscard]] std::optional<TagFix> fix_of(std::span<const Observation> seen, const Landmarks& landmarks,
                                           const TagWatch& watch, const MountedSensor& sensor,
                                           const RiekfOptions& options, const SE2& near,
                                           double most_sigma_m = 0.15);

}  // namespace waymark
