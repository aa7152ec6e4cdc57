#include "waymark/localization/fixed_lag_smoother.hpp"

#include <cmath>

#include "waymark/localization/smoother.hpp"

namespace waymark {

FixedLagSmoother::FixedLagSmoother(Landmarks landmarks, MountedSensor sensor, const RiekfOptions& options)
    : lag_(std::llround(options.lag_s * 1e9)), filter_(std::move(landmarks), std::move(sensor), options) {
  filter_.tracker().keep_trace(lag_);
}

std::optional<LocalizationEstimate> FixedLagSmoother::estimate() const {
  return smoothed_before(filter_.tracker().trace(), lag_);
}

}  // namespace waymark
