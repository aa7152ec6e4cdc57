#include "waymark/sdf/write_sdf_robot.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

#include <fmt/format.h>

#include "waymark/samples/mounted_camera.hpp"
#include "waymark/sdf/sdf_text.hpp"
#include "waymark/sdf/write_sdf_world.hpp"

namespace waymark {
namespace {

constexpr double kBodyMass_kg = 3.2;
constexpr double kWheelMass_kg = 0.2;
constexpr double kWheelWidth_m = 0.045;
constexpr double kWheelbaseShare = 0.6;  // of the length of the hull

/// Moments of inertia of a box of even density.
std::string box_inertia(double mass_kg, const Eigen::Vector3d& size_m, const SE3& link_T_middle) {
  const Eigen::Vector3d square = size_m.cwiseAbs2();
  return fmt::format(
      "        <inertial>{}<mass>{}</mass><inertia><ixx>{:.3e}</ixx><iyy>{:.3e}</iyy><izz>{:.3e}</izz>"
      "<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>\n",
      sdf_text::pose(link_T_middle), mass_kg, mass_kg / 12 * (square.y() + square.z()),
      mass_kg / 12 * (square.x() + square.z()), mass_kg / 12 * (square.x() + square.y()));
}

std::string body_of(const RobotModel& model) {
  const Hull& hull = model.hull;
  const double clearance_m = model.wheel_radius_m / 2;
  const Eigen::Vector3d size_m(hull.front_m + hull.rear_m, std::max(0.02, model.track_m - kWheelWidth_m),
                               std::max(0.02, hull.height_m - clearance_m));
  const SE3 base_T_middle({}, {(hull.front_m - hull.rear_m) / 2, 0, clearance_m + size_m.z() / 2});
  constexpr double kGrey = 0.3;
  // The weight lies low, at the height of the axles.
  const SE3 base_T_weight({}, {base_T_middle.translation().x(), 0, model.wheel_radius_m});
  return box_inertia(kBodyMass_kg, size_m, base_T_weight) +
         sdf_text::solid("body", base_T_middle, sdf_text::box(size_m), kGrey);
}

std::string wheel(const RobotModel& model, const std::string& name, double x_m, double y_m) {
  const SE3 base_T_wheel({}, {x_m, y_m, model.wheel_radius_m});
  const SE3 across(SO3::from_rpy(-M_PI / 2, 0, 0), Eigen::Vector3d::Zero());
  const std::string cylinder =
      fmt::format("<geometry><cylinder><radius>{}</radius><length>{}</length></cylinder></geometry>",
                  model.wheel_radius_m, kWheelWidth_m);
  const double side_m = 2 * model.wheel_radius_m;
  return fmt::format(
      "      <link name='{0}'>{1}\n{2}"
      "        <collision "
      "name='tyre'>{3}{4}<surface><friction><ode><mu>1.2</mu><mu2>1.2</mu2></ode></friction></surface>"
      "</collision>\n        <visual name='tyre'>{3}{4}{5}</visual>\n      </link>\n"
      "      <joint name='{0}_joint' type='revolute'><parent>base_link</parent><child>{0}</child>"
      "<axis><xyz>0 1 0</xyz><limit><lower>-1e16</lower><upper>1e16</upper></limit></axis></joint>\n",
      name, sdf_text::pose(base_T_wheel), box_inertia(kWheelMass_kg, {side_m, kWheelWidth_m, side_m}, SE3()),
      sdf_text::pose(across), cylinder, sdf_text::grey(0.1));
}

std::string wheels_of(const RobotModel& model) {
  const double reach_m = kWheelbaseShare * (model.hull.front_m + model.hull.rear_m) / 2;
  const double middle_m = (model.hull.front_m - model.hull.rear_m) / 2;
  std::string text;
  for (const auto& [end, x_m] :
       {std::pair("front", middle_m + reach_m), std::pair("rear", middle_m - reach_m)}) {
    text += wheel(model, fmt::format("{}_left_wheel", end), x_m, model.track_m / 2);
    text += wheel(model, fmt::format("{}_right_wheel", end), x_m, -model.track_m / 2);
  }
  return text;
}

/// Gazebo Fortress renders a pinhole whose axis goes through the middle of the picture.
std::string camera_of(const RobotDescription& robot, std::vector<std::string>& notes) {
  const CameraModel& camera = robot.camera;
  const auto* pinhole = std::get_if<PinholeRadtan>(&camera.projection());
  const auto* fisheye = std::get_if<Equidistant>(&camera.projection());
  const double fx = pinhole != nullptr ? pinhole->fx : fisheye->fx;
  const auto middle = camera.project({0, 0, 1});
  const bool centred =
      middle && (*middle - Eigen::Vector2d(camera.width_px(), camera.height_px()) / 2).norm() < 0.01;
  const auto straight = camera.project({0.3, 0.2, 1});
  const bool plain = pinhole != nullptr && centred && straight &&
                     std::abs(straight->x() - middle->x() - 0.3 * fx) < 0.01 &&
                     std::abs(straight->y() - middle->y() - 0.2 * fx) < 0.01;
  if (!plain)
    notes.push_back(
        fmt::format("the camera of {} is not the pinhole that Gazebo renders: give the robot a camera_info "
                    "without distortion, with its axis through the middle, as limo-gazebo has it",
                    robot.model.name));
  const SE3 base_T_body = robot.model.base_T_cam * SE3(body_R_optical().inverse(), Eigen::Vector3d::Zero());
  return fmt::format(
      "        <sensor name='camera' type='camera'>{}<topic>camera</topic><update_rate>{}</update_rate>"
      "<camera><horizontal_fov>{:.9f}</horizontal_fov><image><width>{}</width><height>{}</"
      "height><format>R8G8B8</format></image>"
      "<clip><near>0.02</near><far>50</far></clip></camera></sensor>\n",
      sdf_text::pose(base_T_body), robot.simulation.camera_rate_hz,
      2 * std::atan(camera.width_px() / (2 * fx)), camera.width_px(), camera.height_px());
}

std::string lidar_of(const LidarOptions& lidar) {
  if (!(lidar.rate_hz > 0)) return "";
  const double first_rad = lidar.first_ray_deg * M_PI / 180;
  const SE3 base_T_lidar(SO3::from_rpy(0, 0, lidar.yaw_deg * M_PI / 180), {lidar.x_m, lidar.y_m, lidar.z_m});
  return fmt::format(
      "        <sensor name='lidar' "
      "type='gpu_lidar'>{}<topic>scan</topic><update_rate>{}</update_rate><lidar><scan>"
      "<horizontal><samples>{}</samples><min_angle>{:.6f}</min_angle><max_angle>{:.6f}</max_angle></"
      "horizontal></scan>"
      "<range><min>{}</min><max>{}</max></range><noise><type>gaussian</type><mean>0</mean><stddev>{}</"
      "stddev></noise>"
      "</lidar></sensor>\n",
      sdf_text::pose(base_T_lidar), lidar.rate_hz, lidar.rays, first_rad,
      first_rad + 2 * M_PI * (lidar.rays - 1) / lidar.rays, lidar.range_min_m, lidar.range_max_m,
      lidar.noise_m);
}

std::string plugins_of(const RobotDescription& robot, const std::string& name) {
  const RobotModel& model = robot.model;
  const MotionLimits& most = model.limits;
  std::string joints;
  for (const char* side : {"left", "right"})
    for (const char* end : {"front", "rear"})
      joints += fmt::format("<{0}_joint>{1}_{0}_wheel_joint</{0}_joint>", side, end);
  return fmt::format(
      "      <plugin filename='ignition-gazebo-diff-drive-system' "
      "name='ignition::gazebo::systems::DiffDrive'>{0}"
      "<wheel_separation>{1}</wheel_separation><wheel_radius>{2}</wheel_radius>"
      "<odom_publish_frequency>{3}</odom_publish_frequency><topic>/model/{4}/cmd_vel</topic>"
      "<odom_topic>/model/{4}/odometry</odom_topic><frame_id>odom</frame_id><child_frame_id>base_link</"
      "child_frame_id>"
      "<min_linear_velocity>-{5}</min_linear_velocity><max_linear_velocity>{5}</max_linear_velocity>"
      "<min_linear_acceleration>-{6}</min_linear_acceleration><max_linear_acceleration>{6}</"
      "max_linear_acceleration>"
      "<min_angular_velocity>-{7}</min_angular_velocity><max_angular_velocity>{7}</max_angular_velocity>"
      "<min_angular_acceleration>-{8}</min_angular_acceleration><max_angular_acceleration>{8}</"
      "max_angular_acceleration>"
      "</plugin>\n"
      "      <plugin filename='ignition-gazebo-pose-publisher-system' "
      "name='ignition::gazebo::systems::PosePublisher'>"
      "<publish_model_pose>true</publish_model_pose><publish_nested_model_pose>false</"
      "publish_nested_model_pose>"
      "<publish_link_pose>false</publish_link_pose><update_frequency>{9}</update_frequency></plugin>\n",
      joints, model.track_m, model.wheel_radius_m, robot.simulation.odometry_rate_hz, name, most.speed_m_s,
      most.acceleration_m_s2, most.yaw_rate_rad_s, most.yaw_acceleration_rad_s2,
      robot.simulation.truth_rate_hz);
}

}  // namespace

std::string write_sdf_robot(const RobotDescription& robot, const SE3& world_T_base,
                            std::vector<std::string>& notes) {
  const std::string name = sdf_model_name(robot.model.name);
  const std::string imu = fmt::format(
      "        <sensor name='imu' type='imu'><topic>imu</topic><update_rate>{}</update_rate></sensor>\n",
      robot.simulation.imu_rate_hz);
  if (!robot.more_cameras.empty())
    notes.push_back(fmt::format("only the first of the cameras of {} is written", robot.model.name));
  return fmt::format(
      "    <model name='{}'>\n      {}\n      <link name='base_link'>\n{}{}{}{}      </link>\n{}{}    "
      "</model>\n",
      name, sdf_text::pose(world_T_base), body_of(robot.model), camera_of(robot, notes), imu,
      lidar_of(robot.simulation.lidar), wheels_of(robot.model), plugins_of(robot, name));
}

std::string gazebo_profile_of(const RobotDescription& robot, const std::string& robot_file) {
  const std::string name = sdf_model_name(robot.model.name);
  return fmt::format(
      "# How Waymark drives the robot of this world: waymark teach --robot gazebo:THIS_FILE\n"
      "robot: {1}\ncommand_topic: /model/{0}/cmd_vel\nodometry_topic: /model/{0}/odometry\nimu_topic: "
      "/imu\n{2}"
      "image_topic: /camera\ncamera_info_topic: /camera_info\ntruth_topic: /model/{0}/pose\ntruth_model: "
      "{0}\n"
      "clock_topic: /clock\n",
      name, robot_file, robot.simulation.lidar.rate_hz > 0 ? "scan_topic: /scan\n" : "");
}

}  // namespace waymark
