#pragma once

#include "waymark/localization/method.hpp"
#include "waymark/recording/ros2/messages.hpp"

namespace waymark {

/// Topics of a recording of `waymark localize`, in addition to that of its estimates.
inline constexpr const char* kUncertainTopic = "/waymark/pose_uncertain";
inline constexpr const char* kNisTopic = "/waymark/nis";

/// An estimate as a message: its covariance fills the rows of x, y and the rotation about z.
[[nodiscard]] ros2::PoseWithCovarianceStamped estimate_message(const LocalizationEstimate& estimate);

/// Observations compared with the estimate, as diagnostics: one status per observation.
[[nodiscard]] ros2::DiagnosticArray nis_message(const NisRecord& record);

}  // namespace waymark
