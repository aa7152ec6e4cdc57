#pragma once

#include "waymark/mapping/lap/bundle_map.hpp"
#include "waymark/samples/calibration.hpp"

namespace waymark {

struct LapCalibration {
  Calibration calibration{};
  BundleMap map{};  ///< the map, which was estimated together with the calibration
};

/// Calibrates a robot from a lap past tags, without a map. The camera mounting, the odometry scales, the side
/// slip and the camera latency are estimated together with the tags (Triggs, McLauchlan, Hartley and
/// Fitzgibbon, "Bundle Adjustment - A Modern Synthesis", 2000, section 2: self-calibration). Every parameter
/// has a standard deviation. A parameter that the lap does not determine is marked unobservable, with advice
/// on what to drive. Fails if map_by_bundle() fails or if there is no odometry.
[[nodiscard]] Result<LapCalibration> calibrate_by_lap(const LapInput& lap,
                                                      const BundleMapOptions& options = {},
                                                      const MapProgress& progress = {});

}  // namespace waymark
