#include "waymark/app/common/robot_text.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

/// At most so wide, broken at spaces.
std::string wrapped(const std::string& text) {
  constexpr std::size_t kWidth = 100;
  std::string lines;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = std::min(at + kWidth, text.size());
    const std::size_t space = text.rfind(' ', end);
    if (end < text.size() && space != std::string::npos && space > at) end = space;
    lines += text.substr(at, end - at) + "\n";
    at = end + (end < text.size() && text[end] == ' ' ? 1 : 0);
  }
  return lines;
}

/// Degrees without a zero that is negative.
double tenths(double rad) { return std::round(10 * to_degrees(rad)) / 10 + 0.0; }

std::string camera_lines(const MountedCamera& camera) {
  const CameraMounting at = camera_mounting(camera.base_T_cam);
  const double focal_px = std::visit([](const auto& model) { return model.fx; }, camera.camera.projection());
  return fmt::format(
      "camera {}: {} x {} px, focal length {:.1f} px\n"
      "  mounted {:.3f} m forward, {:.3f} m to the left, {:.3f} m above the floor; roll {:.1f}, pitch "
      "{:.1f}, "
      "yaw {:.1f} degrees\n",
      camera.name, camera.camera.width_px(), camera.camera.height_px(), focal_px, at.x_m, at.y_m, at.z_m,
      tenths(at.roll_rad), tenths(at.pitch_rad), tenths(at.yaw_rad));
}

}  // namespace

std::string robot_text(const RobotDescription& robot, const std::string& comment) {
  const Hull& hull = robot.model.hull;
  const MotionLimits& limits = robot.model.limits;
  const SimulatedRobotOptions& simulated = robot.simulation;
  std::string text = robot.model.name + "\n" + wrapped(comment);
  text += fmt::format("body: {:.3f} m long ({:.3f} m of it behind base_link), {:.3f} m wide, {:.3f} m high\n",
                      hull.front_m + hull.rear_m, hull.rear_m, hull.width_m, hull.height_m);
  text += fmt::format("limits: {:g} m/s, {:.3g} rad/s ({:.0f} degrees/s), {:g} m/s^2, {:g} rad/s^2\n",
                      limits.speed_m_s, limits.yaw_rate_rad_s, to_degrees(limits.yaw_rate_rad_s),
                      limits.acceleration_m_s2, limits.yaw_acceleration_rad_s2);
  text +=
      fmt::format("wheels: radius {:g} m, track {:g} m\n", robot.model.wheel_radius_m, robot.model.track_m);
  text += camera_lines({robot.camera_name, robot.camera, robot.model.base_T_cam});
  for (const MountedCamera& camera : robot.more_cameras) text += camera_lines(camera);
  text += fmt::format(
      "in simulation: camera {:g} Hz with {:g} s latency, odometry {:g} Hz, IMU {:g} Hz; commands act after "
      "{:g} s, stop after {:g} s without one\n",
      simulated.camera_rate_hz, simulated.camera_latency_s, simulated.odometry_rate_hz, simulated.imu_rate_hz,
      simulated.dynamics.command_delay_s, simulated.watchdog_s);
  return text;
}

}  // namespace waymark
