#pragma once

#include <span>
#include <vector>

#include "waymark/localization/landmarks.hpp"
#include "waymark/localization/observation.hpp"
#include "waymark/samples/observed_motion.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Motions of the base over about one second each, from the landmarks in the images at their ends alone. No
/// motion sensor has an influence on them, so they can be compared with odometry and gyro. Images whose
/// landmarks determine no pose, or several, are skipped. Stamps are corrected by
/// RiekfOptions::camera_latency_s. Returns at most about 300 motions, spread over the samples, which must be
/// in stamp order.
[[nodiscard]] std::vector<ObservedMotion> observed_motions(std::span<const Sample> samples,
                                                           const Landmarks& landmarks,
                                                           const MountedSensor& sensor,
                                                           const RiekfOptions& options);

}  // namespace waymark
