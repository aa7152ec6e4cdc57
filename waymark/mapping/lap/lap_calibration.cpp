#include "waymark/mapping/lap/lap_calibration.hpp"

#include <array>
#include <cmath>

#include "waymark/camera/intrinsics.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

constexpr const char* kSpeeds =
    "Drive bends to both sides for a minute, slowly and quickly. At a single speed, slip and a wrong camera "
    "mounting are indistinguishable.";
constexpr const char* kTurns = "Drive bends to both sides, always with tags in view.";
constexpr const char* kStraight = "Drive some metres straight past several tags.";
constexpr const char* kUnsteady = "Drive at two speeds, and change speed with tags in view.";

/// Standard deviations below which a parameter is considered usable.
struct Worth {
  double metres = 0.01, radians = 0.01, scale = 0.01, lateral_slip_s = 0.03, camera_latency_s = 0.01,
         bias_rad_s = 0.002;
  double focal_share = 0.005;
};

class CalibrationValues {
 public:
  explicit CalibrationValues(Calibration& calibration) : calibration_(calibration) {}

  void add(const char* name, double value, double sigma, double worth, const char* advice) {
    CalibratedValue entry{.value = value, .sigma = sigma};
    if (!(sigma < worth)) {
      entry.verdict = CalibrationVerdict::Unobservable;
      entry.advice = advice;
    }
    calibration_.values[name] = entry;
  }

 private:
  Calibration& calibration_;
};

/// Mean ratio of the focal lengths (fx, fy) of the two cameras.
double focal_scale(const CameraModel& camera, const CameraModel& given) {
  const Eigen::Vector2d f = intrinsics_of(camera).head<2>();
  return f.cwiseQuotient(intrinsics_of(given).head<2>()).mean();
}

Calibration calibration_of(const LapInput& lap, const MountingEstimate& found) {
  Calibration calibration{.camera = lap.camera, .provenance = {{"method", "lap"}}};
  const CameraMounting camera = camera_mounting(found.base_T_cam);
  const OdometryScales& scales = found.scales;
  const OdometryScales& sigma = found.scales_sigma;
  const Worth worth;
  CalibrationValues values(calibration);
  values.add("mounting_x_m", camera.x_m, found.sigma[0], worth.metres, kSpeeds);
  values.add("mounting_y_m", camera.y_m, found.sigma[1], worth.metres, kTurns);
  // For a nearly level camera, rotations about the base axes are roll, pitch and yaw.
  values.add("mounting_roll_rad", camera.roll_rad, found.sigma[3], worth.radians, kStraight);
  values.add("mounting_pitch_rad", camera.pitch_rad, found.sigma[4], worth.radians, kStraight);
  values.add("mounting_yaw_rad", camera.yaw_rad, found.sigma[5], worth.radians, kStraight);
  values.add("odometry_scale", scales.distance, sigma.distance, worth.scale, kStraight);
  values.add("yaw_scale", scales.yaw, sigma.yaw, worth.scale, kTurns);
  values.add("side_slip_s", scales.lateral_slip_s, sigma.lateral_slip_s, worth.lateral_slip_s, kSpeeds);
  values.add("camera_latency_s", scales.camera_latency_s, sigma.camera_latency_s, worth.camera_latency_s,
             kUnsteady);
  values.add("turn_lead_s", scales.turn_lead_s, sigma.turn_lead_s, worth.camera_latency_s, kTurns);
  values.add("odometry_yaw_bias_rad_s", scales.yaw_bias_rad_s, sigma.yaw_bias_rad_s, worth.bias_rad_s,
             kTurns);
  if (found.focal_scale_sigma > 0)
    values.add("focal_scale", focal_scale(found.camera, lap.camera), found.focal_scale_sigma,
               worth.focal_share, kStraight);
  if (calibration.observable_value("focal_scale")) calibration.camera = found.camera;
  return calibration;
}

/// The camera latency is modelled to first order only, and a robot's turn rate changes within a tenth of a
/// second. The remaining error makes the estimated odometry noise too large and the odometry turns too small
/// (errors in variables; Fuller, "Measurement Error Models", 1987, section 1.1). A second fit therefore
/// starts with corrected stamps.
constexpr double kCameraLatencyForSecondFit_s = 0.005;

/// Restores the stamps of frames as they were recorded.
void add_camera_latency(Duration camera_latency, BundleMap& map) {
  for (StampedPose& pose : map.trajectory) pose.stamp += camera_latency;
  for (StampedPose& pose : map.start_trajectory) pose.stamp += camera_latency;
  for (RejectedObservation& rejected : map.rejected) rejected.stamp += camera_latency;
  map.mounting->scales.camera_latency_s += to_seconds(camera_latency);
  map.odometry_scales.camera_latency_s += to_seconds(camera_latency);
}

/// With a wrong mounting or focal length, unmoved tags appear moved. The lap is therefore mapped again with
/// the estimated camera.
void fit_again(const LapInput& lap, const BundleMapOptions& options, const MapProgress& progress,
               BundleMap& map) {
  LapInput again = lap;
  if (!map.prior_warnings.empty()) {
    again.base_T_cam = map.mounting->base_T_cam;
    again.camera = map.mounting->camera;
  }
  const Duration camera_latency(std::llround(1e9 * map.mounting->scales.camera_latency_s));
  for (TagFrame& frame : again.frames) frame.stamp -= camera_latency;
  Result<BundleMap> better = map_by_bundle(again, {}, options, progress);
  if (!better || !better->mounting || better->prior_agreeing < map.prior_agreeing) return;
  add_camera_latency(camera_latency, *better);
  map = std::move(*better);
}

}  // namespace

Result<LapCalibration> calibrate_by_lap(const LapInput& lap, const BundleMapOptions& options,
                                        const MapProgress& progress) {
  if (lap.odometry.empty())
    return fail(ErrorCode::NotFound,
                "the lap has no odometry; tags alone determine only the camera trajectory", {},
                "Record odometry together with the tags.");
  BundleMapOptions freed = options;
  freed.find_mounting = true;
  constexpr double kFocalShare = 0.01;
  if (lap.prior) freed.focal_share = kFocalShare;
  Result<BundleMap> map = map_by_bundle(lap, {}, freed, progress);
  if (!map) return tl::unexpected(map.error());
  if (!map->mounting)
    return fail(ErrorCode::InvalidArgument, "tags and odometry do not overlap in time", {},
                "Check that their stamps are from one clock; `waymark info` shows both.");
  if (!map->prior_warnings.empty() ||
      std::abs(map->mounting->scales.camera_latency_s) > kCameraLatencyForSecondFit_s)
    fit_again(lap, freed, progress, *map);
  return LapCalibration{calibration_of(lap, *map->mounting), std::move(*map)};
}

}  // namespace waymark
