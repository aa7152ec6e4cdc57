#pragma once

#include <optional>
#include <span>

#include "waymark/localization/method.hpp"
#include "waymark/localization/observation.hpp"
#include "waymark/localization/watches.hpp"

namespace waymark {

/// The pose on the floor that fits the tags of one image best, searched from `near`: robust Gauss-Newton with
/// Student weights (Lange, Little and Taylor, "Robust Statistical Modeling Using the t Distribution", JASA
/// 84(408), 1989). The covariance contains the lasting errors of the mapped tags relative to their neighbours
/// and a robot tilt of one degree. It does not contain errors that nearby tags share, because fixes are
/// compared with each other. Returns nothing if the search does not converge or the standard deviation of the
/// position exceeds `most_sigma_m`. Suspected tags are used if an image shows no others, because a tag that
/// was moved once but is now fixed still shows the motion of the robot. No allocation.
[[nodiscard]] std::optional<TagFix> fix_of(std::span<const Observation> seen, const Landmarks& landmarks,
                                           const TagWatch& watch, const MountedSensor& sensor,
                                           const RiekfOptions& options, const SE2& near,
                                           double most_sigma_m = 0.15);

}  // namespace waymark
