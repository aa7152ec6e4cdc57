#include "waymark/app/robot/robot_table.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/gazebo/profile.hpp"
#include "waymark/robots/ros2/profile.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

/// Wraps the text at spaces to this width.
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

/// Converts to degrees, avoiding negative zero.
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

namespace {

std::string topics_of(const GazeboProfile& profile) {
  std::string words = fmt::format("commands {}, odometry {}", profile.command_topic, profile.odometry_topic);
  if (!profile.image_topic.empty()) words += ", images " + profile.image_topic;
  return words;
}

std::string topics_of(const Ros2Profile& profile) {
  std::string words = fmt::format("commands {}, odometry {}", profile.command_topic, profile.odometry_topic);
  const auto add = [&](const char* what, const std::string& topic) {
    if (!topic.empty()) words += fmt::format(", {} {}", what, topic);
  };
  add("IMU", profile.imu_topic);
  add("images", profile.image_topic);
  add("images", profile.compressed_image_topic);
  add("tags", profile.detections_topic);
  add("scans", profile.scan_topic);
  return words;
}

/// The profiles of this kind that are for the robot.
template <class Find>
void add_profiles(const std::string& kind, const Find& find, const std::string& robot,
                  std::vector<std::string>& ways) {
  const auto profiles = list_shared(kind);
  if (!profiles) return;
  for (const ListedFile& listed : *profiles) {
    const auto profile = find(listed.path.string());
    if (profile && profile->robot == robot)
      ways.push_back(fmt::format("`robot={}:{}` ({})", kind, listed.name, topics_of(*profile)));
  }
}

}  // namespace

std::vector<std::string> ways_to_reach(const std::string& robot) {
  std::vector<std::string> connections;
  for (const RobotKind& kind : robot_kinds())
    if (kind.name == robot)
      connections.push_back(fmt::format("`robot={}:{}` ({})", kind.name, kind.address, kind.help));
  add_profiles("ros2", find_ros2_profile, robot, connections);
  add_profiles("gazebo", find_gazebo_profile, robot, connections);
  connections.push_back(
      fmt::format("`robot=process:CMD` `robot_file={}` (docs/formats/robot-process.md)", robot));
  return connections;
}

Result<RobotTable> robot_table() {
  const auto robots = list_shared("robots");
  if (!robots) return tl::unexpected(robots.error());
  RobotTable table;
  for (const ListedFile& listed : *robots) {
    const auto shown = read_commented_robot(listed.path);
    if (shown)
      table.text += fmt::format("{:<20} {}\n", listed.name, first_sentence(shown->comment));
    else
      table.errors.push_back(shown.error());
  }
  return table;
}

Result<std::string> explained_robot(const std::string& name) {
  const auto path = find_shared("robots", name, "robot");
  const auto shown = path ? read_commented_robot(*path) : tl::unexpected(path.error());
  if (!shown) return tl::unexpected(shown.error());
  std::string text = robot_text(shown->robot, shown->comment);
  text += fmt::format("file: {}\n", path->string());
  for (const std::string& connection : ways_to_reach(shown->robot.model.name)) text += connection + "\n";
  return text;
}

}  // namespace waymark
