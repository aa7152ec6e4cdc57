#include "waymark/sdf/write_sdf.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <variant>

#include <fmt/format.h>

#include "waymark/families/family.hpp"
#include "waymark/plot/text.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark::sdf_text {

std::string pose(const SE3& pose) {
  const Eigen::Vector3d& t = pose.translation();
  const Eigen::Vector3d rpy = pose.rotation().rpy();
  return fmt::format("<pose>{:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f}</pose>", t.x(), t.y(), t.z(), rpy.x(),
                     rpy.y(), rpy.z());
}

std::string box(const Eigen::Vector3d& size_m) {
  return fmt::format("<geometry><box><size>{:.6f} {:.6f} {:.6f}</size></box></geometry>", size_m.x(),
                     size_m.y(), size_m.z());
}

std::string grey(double reflectance) {
  return fmt::format(
      "<material><ambient>{0:.3f} {0:.3f} {0:.3f} 1</ambient><diffuse>{0:.3f} {0:.3f} {0:.3f} 1</diffuse>"
      "<specular>0 0 0 1</specular></material>",
      reflectance);
}

std::string solid(std::string_view name, const SE3& link_T_solid, std::string_view geometry,
                  double reflectance) {
  const std::string where = pose(link_T_solid);
  return fmt::format(
      "        <collision name='{0}'>{1}{2}</collision>\n"
      "        <visual name='{0}'>{1}{2}{3}</visual>\n",
      plot::escaped(name), where, geometry, grey(reflectance));
}

std::string fixed_model(std::string_view name, const SE3& world_T_model, std::string_view content) {
  return fmt::format(
      "    <model name='{}'>\n      <static>true</static>{}\n      <link name='link'>\n{}      </link>\n"
      "    </model>\n",
      plot::escaped(name), pose(world_T_model), content);
}

}  // namespace waymark::sdf_text

namespace waymark {
namespace {

constexpr double kBoard_m = 0.01;     // board thickness for a tag without a board of its own
constexpr double kBefore_m = 0.0005;  // distance from the board to the tag, to prevent z-fighting
constexpr int kPixelsPerCell = 32;
constexpr double kWhite = 0.9;

std::string texture_name(const TagId& tag) {
  return fmt::format("{}_{}.png", to_string(tag.family), tag.number);
}

/// The tag with its white margin, at kPixelsPerCell pixels per cell.
Image texture_of(const TagId& tag, double margin_cells) {
  const int cells = family(tag.family).total_width;
  const std::vector<std::uint8_t> bits = bitmap(tag);
  const auto margin_px = static_cast<int>(std::lround(margin_cells * kPixelsPerCell));
  const int side_px = cells * kPixelsPerCell + 2 * margin_px;
  Image image(side_px, side_px, 255);
  for (int y = 0; y < cells * kPixelsPerCell; ++y)
    for (int x = 0; x < cells * kPixelsPerCell; ++x) {
      const int cell = (y / kPixelsPerCell) * cells + x / kPixelsPerCell;
      const std::uint8_t level = bits[static_cast<std::size_t>(cell)];
      constexpr std::uint8_t kNotOfTheTag = 128;
      image.row(y + margin_px)[x + margin_px] = level == kNotOfTheTag ? std::uint8_t{255} : level;
    }
  return image;
}

/// A tag faces along -z of its own frame (x right, y down); an SDF plane faces along +z, with the upper edge
/// of its image at +y.
std::string tag_model(const std::string& name, const TagId& tag, const MappedTag& placed, double margin_cells,
                      bool with_board) {
  const Family& layout = family(tag.family);
  const double cell_m = placed.size_m / layout.width_at_border;
  const double paper_m = (layout.total_width + 2 * margin_cells) * cell_m;
  const SE3 tag_T_plane(SO3::from_rpy(M_PI, 0, 0), Eigen::Vector3d::Zero());
  std::string content = fmt::format(
      "        <visual name='tag'><geometry><plane><normal>0 0 1</normal><size>{0:.6f} "
      "{0:.6f}</size></plane></geometry>"
      "<material><diffuse>1 1 1 1</diffuse><specular>0 0 0 "
      "1</specular><pbr><metal><albedo_map>{1}</albedo_map>"
      "<metalness>0</metalness><roughness>1</roughness></metal></pbr></material></visual>\n",
      paper_m, texture_name(tag));
  if (with_board)
    content += sdf_text::solid("board", SE3({}, {0, 0, -kBefore_m - kBoard_m / 2}),
                               sdf_text::box({paper_m, paper_m, kBoard_m}), kWhite);
  return sdf_text::fixed_model(name, placed.map_T_tag * tag_T_plane, content);
}

/// The board between the front and back of a tag that is printed on both sides.
std::string board_model(const TagId& tag, const MappedTag& placed, const World& world) {
  const Family& layout = family(tag.family);
  const double paper_m =
      (layout.total_width + 2 * world.tag_margin_cells) * placed.size_m / layout.width_at_border;
  const double thick_m = std::max(1e-4, world.tag_board_m - 2 * kBefore_m);
  const std::string content =
      sdf_text::solid("board", SE3(), sdf_text::box({paper_m, paper_m, thick_m}), kWhite);
  return sdf_text::fixed_model(fmt::format("board_{}_{}", to_string(tag.family), tag.number),
                               placed.map_T_tag * SE3({}, {0, 0, world.tag_board_m / 2}), content);
}

std::string tags_of(const World& world, SdfFiles& files) {
  std::string text;
  std::set<TagId> drawn;
  std::set<TagId> on_panels;
  for (const Panel& panel : world.panels) on_panels.insert(panel.tags.begin(), panel.tags.end());
  int number = 0;
  for (const auto& [tag, placed] : readable_tags(world)) {
    const std::string name = fmt::format("{}_{}_{}", to_string(tag.family), tag.number, number++);
    text += tag_model(name, tag, placed, world.tag_margin_cells,
                      !(world.tag_board_m > 0) && !on_panels.contains(tag));
    if (drawn.insert(tag).second)
      files.textures.push_back({texture_name(tag), texture_of(tag, world.tag_margin_cells)});
  }
  if (world.tag_board_m > 0)
    for (const auto& [tag, placed] : world.tags.tags)
      if (!on_panels.contains(tag)) text += board_model(tag, placed, world);
  return text;
}

std::string scenery_of(const World& world) {
  std::string text;
  std::vector<Occluder> boxes = world.occluders;
  std::ranges::transform(world.walls, std::back_inserter(boxes), as_box);
  int number = 0;
  for (const Occluder& box : boxes)
    text += sdf_text::fixed_model(fmt::format("box_{}", number++),
                                  SE3(SO3::from_rpy(0, 0, box.yaw_rad), box.centre_m),
                                  sdf_text::solid("box", SE3(), sdf_text::box(box.size_m), box.reflectance));
  number = 0;
  for (const Panel& panel : world.panels) {
    const SE3 behind({}, {0, 0, kBefore_m + panel.thickness_m / 2});
    text += sdf_text::fixed_model(
        fmt::format("panel_{}", number++), panel.map_T_panel * behind,
        sdf_text::solid("panel", SE3(), sdf_text::box({panel.width_m, panel.height_m, panel.thickness_m}),
                        panel.reflectance));
  }
  return text;
}

/// Pose at the start of the line, facing along it.
SE3 start_of(const World& world) {
  if (world.path_m.size() < 2) return {};
  const Eigen::Vector2d along = world.path_m[1] - world.path_m[0];
  return {SO3::from_rpy(0, 0, std::atan2(along.y(), along.x())),
          Eigen::Vector3d(world.path_m[0].x(), world.path_m[0].y(), 0)};
}

constexpr const char* kWorldPlugins =
    R"(    <physics name='1ms' type='ignored'><max_step_size>0.001</max_step_size><real_time_factor>1</real_time_factor></physics>
    <plugin filename='ignition-gazebo-physics-system' name='ignition::gazebo::systems::Physics'/>
    <plugin filename='ignition-gazebo-user-commands-system' name='ignition::gazebo::systems::UserCommands'/>
    <plugin filename='ignition-gazebo-scene-broadcaster-system' name='ignition::gazebo::systems::SceneBroadcaster'/>
    <plugin filename='ignition-gazebo-imu-system' name='ignition::gazebo::systems::Imu'/>
    <plugin filename='ignition-gazebo-sensors-system' name='ignition::gazebo::systems::Sensors'><render_engine>ogre2</render_engine></plugin>
    <scene><ambient>0.6 0.6 0.6 1</ambient><background>0.8 0.8 0.8 1</background><shadows>false</shadows></scene>
    <light type='directional' name='sun'><pose>0 0 10 0 0 0</pose><cast_shadows>false</cast_shadows><diffuse>0.5 0.5 0.5 1</diffuse><specular>0 0 0 1</specular><direction>-0.3 0.2 -0.9</direction></light>
)";

}  // namespace

std::string sdf_model_name(const std::string& name) {
  std::string plain = name;
  std::ranges::replace_if(
      plain, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return plain.empty() ? "robot" : plain;
}

SdfFiles write_sdf_world(const World& world, const RobotDescription& robot) {
  SdfFiles files;
  const std::string ground = "<geometry><plane><normal>0 0 1</normal><size>200 200</size></plane></geometry>";
  const std::string places =
      sdf_text::fixed_model("floor", SE3(),
                            sdf_text::solid("floor", SE3(), ground, world.floor.reflectance)) +
      scenery_of(world) + tags_of(world, files);
  files.world = fmt::format(
      "<?xml version='1.0'?>\n<!-- Written by Waymark for Gazebo Fortress. Frame world is the frame map. "
      "-->\n"
      "<sdf version='1.9'>\n  <world name='{1}'>\n{2}{3}{4}  </world>\n</sdf>\n",
      plot::escaped(world.name), sdf_model_name(world.name), kWorldPlugins, places,
      write_sdf_robot(robot, start_of(world), files.notes));
  return files;
}

namespace {

constexpr double kBodyMass_kg = 3.2;
constexpr double kWheelMass_kg = 0.2;
constexpr double kWheelWidth_m = 0.045;
constexpr double kWheelbaseShare = 0.6;  // as a fraction of the length of the hull

/// Moments of inertia of a homogeneous box.
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
  // The centre of mass is at the height of the axles.
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

/// Gazebo Fortress renders pinhole cameras with the principal point at the image centre.
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
        fmt::format("the camera of {} is not the pinhole camera that Gazebo renders; give the robot a "
                    "camera_info without "
                    "distortion and with a central principal point, as in limo-gazebo",
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
    notes.push_back(fmt::format("only the first camera of {} is written", robot.model.name));
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
