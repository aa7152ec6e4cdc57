#include "waymark/pipeline/lap_diagnosis.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "waymark/mapping/lap/tag_motions.hpp"
#include "waymark/pipeline/lap_mapper.hpp"

namespace waymark {
namespace {

/// Frames of the first camera, about four per second. Those of a long lap come in pairs of one second with
/// gaps between them.
std::vector<ObservedFrame> some_frames(const TaughtLap& taught, const TeachSetup& setup) {
  constexpr double kInterval_s = 0.24;
  constexpr double kPair_s = 1.7;
  constexpr double kMaxPairs = 300;
  std::vector<ObservedFrame> observed;
  if (taught.frames.empty()) return observed;
  const SensorTime begin = taught.frames.front().stamp;
  const double duration_s = to_seconds(taught.frames.back().stamp - begin);
  const double period_s = std::max(kPair_s, duration_s / kMaxPairs);
  double last_s = -1;
  for (const TagFrame& frame : taught.frames) {
    const double at_s = to_seconds(frame.stamp - begin);
    const bool in_gap = at_s - period_s * std::floor(at_s / period_s) > kPair_s;
    const bool other =
        std::ranges::find(setup.more_cameras, frame.camera, &MountedCamera::name) != setup.more_cameras.end();
    if (other || in_gap || frame.detections.empty() || at_s < last_s + kInterval_s) continue;
    observed.push_back(observe(frame, setup));
    last_s = at_s;
  }
  return observed;
}

}  // namespace

SensorDiagnosis diagnose_lap(const TaughtLap& taught, const TeachSetup& setup) {
  return diagnose_sensors({.odometry = taught.odometry,
                           .imu = taught.imu,
                           .observed = motions_by_tags(some_frames(taught, setup), setup.base_T_cam)});
}

SensorDiagnosis diagnose_turns(const TaughtLap& taught, TeachSetup setup) {
  constexpr double kAnySize_m = 0.16;
  constexpr double kUnknown_m = std::numeric_limits<double>::infinity();
  setup.sizes = {.default_size_m = kAnySize_m};
  MotionSources sources{.odometry = taught.odometry,
                        .imu = taught.imu,
                        .observed = motions_by_tags(some_frames(taught, setup), setup.base_T_cam)};
  for (ObservedMotion& motion : sources.observed) motion.sigma_m = kUnknown_m;
  return diagnose_sensors(std::move(sources));
}

bool changes_lap(const SensorCorrection& correction) {
  return correction.changes_imu() || correction.changes_odometry() || !correction.gyro_usable ||
         correction.observations_late_s != 0;
}

void apply(const SensorCorrection& correction, TaughtLap& taught) {
  const auto late =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(correction.observations_late_s));
  if (!correction.gyro_usable) taught.imu.clear();
  for (ImuSample& sample : taught.imu) {
    sample = correction.corrected(sample);
    sample.stamp += late;
  }
  for (Odometry& sample : taught.odometry) {
    sample = correction.corrected(sample);
    sample.stamp += late;
  }
}

}  // namespace waymark
