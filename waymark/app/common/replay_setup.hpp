#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/pipeline/localizer.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/samples/calibration.hpp"
#include "waymark/samples/route.hpp"

/// Creates a Replayer for any robot from a folder written by `waymark map`.
namespace waymark {

/// The contents of a map folder that are needed for replay.
struct MapFolder {
  std::filesystem::path path{};
  MapFile map{};
  Route route{};
  std::string route_name{};                 ///< empty for route.yaml
  std::optional<RobotDescription> robot{};  ///< read from robot.yaml; `nullopt` if the folder does not
                                            ///< contain it
  std::optional<Calibration> odometry{};    ///< estimated from the lap; empty in folders with older maps
};

/// Reads map.yaml, a route (route.yaml if the name is empty, otherwise route-NAME.yaml) and robot.yaml.
/// Fails, naming the file, if the map or the route does not exist, or if the route belongs to another map.
[[nodiscard]] Result<MapFolder> read_map_folder(const std::filesystem::path& folder,
                                                const std::string& route = {});
/// The same without robot.yaml, for a robot whose description comes from elsewhere.
[[nodiscard]] Result<MapFolder> read_map_and_route(const std::filesystem::path& folder,
                                                   const std::string& route = {});

struct ReplayerSetup {
  LocalizationKind method = LocalizationKind::Riekf;
  RiekfOptions filter{};
  AnchorOptions anchor{};
  std::optional<Calibration> calibration{};  ///< calibration of camera and mounting; replaces the values in
                                             ///< the robot description
  ReplayOptions replay{};                    ///< laps, controller, limits; the lidar mounting is taken from
                                             ///< the robot
};

/// Fails (Unsupported) if the folder's route moves sideways, because no replay can drive it. make_replayer()
/// checks this as well.
[[nodiscard]] Status check_drivable(const MapFolder& folder);

/// Creates a Replayer for the folder's route and this robot, which is expected to start near the first point
/// of the route. Fails as check_drivable() does. The odometry calibration from the lap is used if it is for a
/// robot with the same name, unless the setup changes the default.
[[nodiscard]] Result<std::unique_ptr<Replayer>> make_replayer(const MapFolder& folder,
                                                              const RobotDescription& robot,
                                                              const ReplayerSetup& setup = {});
/// The same for the robot described in the folder. Fails (NotFound) if the folder does not contain
/// robot.yaml.
[[nodiscard]] Result<std::unique_ptr<Replayer>> make_replayer(const MapFolder& folder,
                                                              const ReplayerSetup& setup = {});

}  // namespace waymark
