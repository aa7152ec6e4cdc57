#pragma once

#include "waymark/mapping/lap/bundle_map.hpp"
#include "waymark/samples/calibration.hpp"

namespace waymark {

struct LapCalibration {
  Calibration calibration{};
  BundleMap map{};  ///< that came with it
};

/// What a lap past tags tells of its robot without a map: where the camera sits, the scales of the wheels,
/// side slip and the age of the pictures are found together with the tags (Triggs, McLauchlan, Hartley and
/// Fitzgibbon, "Bundle Adjustment - A Modern Synthesis", 2000, section 2: self-calibration). Every number has
/// its standard deviation, and one that the lap does not tell is called unobservable and says what to drive.
/// Fails as map_by_bundle does, and without odometry.
[[nodiscard]] Result<LapCalibration> calibrate_by_lap(const LapInput& lap,
                                                      const BundleMapOptions& options = {},
                                                      const MapProgress& progress = {});

}  // namespace waymark
