#include "waymark/app/common/replay_setup.hpp"

#include <utility>

#include "waymark/app/common/route_files.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/yaml/calibration_file.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/replay/route_checks.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// Reads the odometry calibration from the lap of the route or, for a route without a lap, of the first
/// route.
Result<std::optional<Calibration>> odometry_in(const fs::path& folder, const std::string& route_name) {
  std::error_code ignored;
  for (const std::string& route : {route_name, std::string()}) {
    const fs::path path = folder / file_name_for_route("odometry", route, ".yaml");
    if (!fs::exists(path, ignored)) continue;
    Result<Calibration> found = read_calibration(path);
    if (!found) return tl::unexpected(found.error());
    return std::optional<Calibration>(std::move(*found));
  }
  return std::optional<Calibration>();
}

/// Applies the odometry calibration from the lap if it belongs to this robot. An explicitly specified
/// calibration, and options that differ from their defaults, take precedence.
void take_odometry(const std::optional<Calibration>& found, const RobotModel& robot, ReplayerSetup& setup) {
  if (!found) return;
  for (const auto& [key, name] : found->provenance) {
    if (key == "robot" && name != robot.name) return;
  }
  Calibration odometry = *found;
  if (setup.calibration) {
    for (const auto& [name, value] : setup.calibration->values) odometry.values[name] = value;
  }
  const auto known = [&](const char* name, double& value, double usual) {
    if (const auto estimated = odometry.observable_value(name); estimated && value == usual)
      value = *estimated;
  };
  const RiekfOptions usual;
  RiekfOptions& filter = setup.filter;
  known("odometry_scale", filter.odometry_scale, usual.odometry_scale);
  known("yaw_scale", filter.yaw_scale, usual.yaw_scale);
  known("yaw_noise_rad_sqrt_m", filter.motion.wheel_yaw_rad_sqrt_m, usual.motion.wheel_yaw_rad_sqrt_m);
  known("yaw_scale", setup.replay.actuators.turn_gain, ActuatorOptions{}.turn_gain);
  setup.replay.odometry = odometry_prior(odometry);
}

/// Standard deviations of the robot's pose when placed by hand at the start of the route.
constexpr double kPlaced_m = 0.25;
constexpr double kPlaced_rad = 0.25;

Result<std::optional<RobotDescription>> robot_in(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(folder / "robot.yaml", ignored)) return std::optional<RobotDescription>();
  Result<RobotDescription> robot = read_robot(folder / "robot.yaml");
  if (!robot) return tl::unexpected(robot.error());
  return std::optional<RobotDescription>(std::move(*robot));
}

MountedSensor camera_of(const RobotDescription& robot, const std::optional<Calibration>& calibration) {
  MountedSensor mounted{robot.camera, robot.model.base_T_cam, robot.more_cameras};
  if (!calibration) return mounted;
  if (calibration->camera) mounted.camera = calibration->camera;
  mounted.base_T_sensor = calibrated_mounting(mounted.base_T_sensor, *calibration);
  return mounted;
}

std::vector<MountedCamera> cameras_of(const MountedSensor& mounted) {
  std::vector<MountedCamera> all = {{.camera = *mounted.camera, .base_T_cam = mounted.base_T_sensor}};
  all.insert(all.end(), mounted.more_cameras.begin(), mounted.more_cameras.end());
  return all;
}

SE2 lidar_of(const RobotDescription& robot) {
  const LidarOptions& lidar = robot.simulation.lidar;
  return {lidar.x_m, lidar.y_m, to_radians(lidar.yaw_deg)};
}

}  // namespace

Result<MapFolder> read_map_and_route(const fs::path& folder, const std::string& route_name) {
  if (Status status = check_map_folder(folder); !status) return tl::unexpected(status.error());
  Result<MapFile> map = read_map(folder / "map.yaml");
  if (!map) return tl::unexpected(map.error());
  Status status = check_route_exists(folder, route_name);
  if (!status) return tl::unexpected(status.error());
  const fs::path route_file = folder / route_file_name(route_name);
  Result<Route> route = read_route(route_file);
  if (!route) return tl::unexpected(route.error());
  status = check_map(*route, map->tags, route_file.string());
  if (!status) return tl::unexpected(status.error());
  Result<std::optional<Calibration>> odometry = odometry_in(folder, route_name);
  if (!odometry) return tl::unexpected(odometry.error());
  return MapFolder{.path = folder,
                   .map = std::move(*map),
                   .route = std::move(*route),
                   .route_name = route_name,
                   .odometry = std::move(*odometry)};
}

Result<MapFolder> read_map_folder(const fs::path& folder, const std::string& route_name) {
  Result<MapFolder> read = read_map_and_route(folder, route_name);
  if (!read) return read;
  Result<std::optional<RobotDescription>> robot = robot_in(folder);
  if (!robot) return tl::unexpected(robot.error());
  read->robot = std::move(*robot);
  return read;
}

Status check_drivable(const MapFolder& folder) {
  return check_sideways(folder.route, (folder.path / route_file_name(folder.route_name)).string());
}

Result<std::unique_ptr<Replayer>> make_replayer(const MapFolder& folder, const RobotDescription& robot,
                                                const ReplayerSetup& asked) {
  if (Status drivable = check_drivable(folder); !drivable) return tl::unexpected(drivable.error());
  ReplayerSetup setup = asked;
  take_odometry(folder.odometry, robot.model, setup);
  const MountedSensor mounted = camera_of(robot, setup.calibration);
  const TagMap& tags = folder.map.tags;
  Result<std::unique_ptr<LocalizationMethod>> method = make_localization_method({.landmarks = Landmarks(tags),
                                                                                 .tags = tags,
                                                                                 .sensor = mounted,
                                                                                 .method = setup.method,
                                                                                 .filter = setup.filter,
                                                                                 .anchor = setup.anchor,
                                                                                 .live = true});
  if (!method) return tl::unexpected(method.error());
  // The robot is placed near the start of the route, so a single tag determines the pose. Tags that
  // contradict this placement take precedence.
  (*method)->start_from(folder.route.points.front().map_T_base, kPlaced_m, kPlaced_rad);
  Route route = folder.route;
  if (!route.longest_without_tags_m)
    route.longest_without_tags_m = longest_without_tags_m(route, tags, cameras_of(mounted));
  ReplayOptions options = setup.replay;
  options.base_T_lidar = lidar_of(robot);
  return std::make_unique<Replayer>(std::move(*method), std::move(route), tags, robot.model, options);
}

Result<std::unique_ptr<Replayer>> make_replayer(const MapFolder& folder, const ReplayerSetup& setup) {
  if (folder.robot) return make_replayer(folder, *folder.robot, setup);
  return fail(ErrorCode::NotFound, "the map folder contains no robot file",
              {.source = (folder.path / "robot.yaml").string()},
              "Copy the robot file there, or pass a RobotDescription.");
}

}  // namespace waymark
