#pragma once

#include "waymark/mapping/lap/lap_bundle.hpp"

namespace waymark::internal {

/// Odometry that is right to some per cent, which is what a search can begin with.
struct RoughOdometry {
  std::vector<Odometry> odometry{};
  double distance = 1;         ///< what the distances of the wheels were multiplied by
  double yaw = 1;              ///< and their turns; of a gyro: what would have been right for the wheels
  bool turns_by_gyro = false;  ///< turns are those of the gyro, scaled and without its bias
  /// Where samples of the gyro are missing, and turns are those of the wheels all the same.
  std::vector<TimeSpan> without_gyro{};
  double without_gyro_share = 0;  ///< of the time of the odometry
};

/// Holds what the wheels, and the gyro where there is one, say of a second against how the base moved past
/// the tags it saw before and after, one tag at a time: no map is needed, and no tag need be the one it is
/// taken for. Scales are those of least absolute deviations (a weighted median of ratios), so that a moved
/// tag, a wrong id or a mirrored pose has little say. Wheels that are nearly right stay as they are: the
/// bundle finds the rest. A gyro turns for the wheels where it agrees with the tags clearly better, as on a
/// robot that skids; where its samples are missing the wheels turn, with the scale found for them. O(frames *
/// tags of a frame).
[[nodiscard]] RoughOdometry rough_odometry(const LapInput& lap, const std::vector<ObservedFrame>& observed);

}  // namespace waymark::internal
