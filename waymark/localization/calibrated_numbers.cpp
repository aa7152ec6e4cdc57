// The numbers that a calibration finds: what they are called, and sensor and options with them put in.
#include <variant>

#include "waymark/localization/innovation_calibration.hpp"

namespace waymark {

std::string_view to_string(Calibrated what) {
  constexpr std::array<std::string_view, kCalibrated> kNames = {
      "mounting_x_m", "mounting_y_m",      "mounting_yaw_rad",   "odometry_scale",
      "yaw_gain",     "gyro_gain",         "camera_latency_s",   "sight_scale",
      "mounting_z_m", "mounting_roll_rad", "mounting_pitch_rad", "focal_scale"};
  return kNames.at(static_cast<std::size_t>(what));
}

MountedSensor calibrated_sensor(const MountedSensor& sensor, const CalibratedNumbers& numbers) {
  MountedSensor moved = sensor;
  const SE3& T = sensor.base_T_sensor;
  moved.base_T_sensor = SE3(SO3::exp({numbers[9], numbers[10], numbers[2]}) * T.rotation(),
                            T.translation() + Eigen::Vector3d(numbers[0], numbers[1], numbers[8]));
  if (!sensor.camera || numbers[11] == 1) return moved;
  CameraModel::Projection projection = sensor.camera->projection();
  std::visit(
      [&](auto& p) {
        p.fx *= numbers[11];
        p.fy *= numbers[11];
      },
      projection);
  const auto camera = CameraModel::make(projection, sensor.camera->width_px(), sensor.camera->height_px());
  if (camera) moved.camera = *camera;
  return moved;
}

RiekfOptions calibrated_options(const RiekfOptions& options, const CalibratedNumbers& numbers) {
  RiekfOptions out = options;
  out.odometry_scale = numbers[3];
  out.yaw_gain = numbers[4];
  out.gyro_gain = numbers[5];
  out.camera_latency_s = numbers[6];
  out.sight_scale = numbers[7];
  return out;
}

}  // namespace waymark
