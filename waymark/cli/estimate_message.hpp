#pragma once

#include "waymark/localization/method.hpp"
#include "waymark/recording/ros2_messages.hpp"

namespace waymark::cli {

/// An estimate as a message: what it doubts stands in the rows of x, y and the rotation about z.
[[nodiscard]] ros2::PoseWithCovarianceStamped estimate_message(const LocalizationEstimate& estimate);

}  // namespace waymark::cli
