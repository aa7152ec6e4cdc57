#pragma once

#include "waymark/mapping/lap/lap_bundle.hpp"

namespace waymark::internal {

/// Odometry corrected to within a few per cent, sufficient to start a search.
struct RoughOdometry {
  std::vector<Odometry> odometry{};
  double distance = 1;  ///< factor applied to the odometry distances
  /// Factor applied to odometry turns; if gyro turns replace them, the factor that they would need.
  double yaw = 1;
  bool turns_by_gyro = false;  ///< turns are those of the gyro, scaled and without its bias
  /// Times without gyro samples, in which turns are from odometry.
  std::vector<TimeSpan> without_gyro{};
  double without_gyro_share = 0;  ///< share of the odometry time
};

/// Compares the motion by odometry, and by a gyro if there is one, over one second with the motion by tags.
/// The latter is that of the base relative to the tags observed before and after, one tag at a time. It needs
/// no map and no correct tag ids. Scales minimise absolute deviations (a weighted median of ratios), so a
/// moved tag, a wrong id or a mirrored pose has little effect. Nearly correct odometry is not changed; the
/// bundle estimates the rest. Gyro turns replace odometry turns if they agree with the tags clearly better,
/// as on a skid-steered robot. Odometry turns with their estimated scale fill gaps of the gyro. O(frames *
/// tags per frame).
[[nodiscard]] RoughOdometry rough_odometry(const LapInput& lap, const std::vector<ObservedFrame>& observed);

}  // namespace waymark::internal
