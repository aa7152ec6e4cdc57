#pragma once

#include "waymark/localization/method.hpp"
#include "waymark/recording/ros2/messages.hpp"

namespace waymark {

/// Topics in a recording by `waymark localize`, in addition to the topic of its estimates.
inline constexpr const char* kUncertainTopic = "/waymark/pose_uncertain";
inline constexpr const char* kNisTopic = "/waymark/nis";

/// Converts an estimate to a message. Its covariance fills the rows for x, y and the rotation about z.
[[nodiscard]] ros2::PoseWithCovarianceStamped estimate_message(const LocalizationEstimate& estimate);

/// Converts comparisons of observations with the estimate to diagnostics, with one status per observation.
[[nodiscard]] ros2::DiagnosticArray nis_message(const NisRecord& record);

}  // namespace waymark
