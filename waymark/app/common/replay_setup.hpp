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

/// Makes a Replayer for any robot from a folder written by `waymark map`.
namespace waymark {

/// The contents of a map folder that a replay uses.
struct MapFolder {
  std::filesystem::path path{};
  MapFile map{};
  Route route{};
  std::optional<RobotDescription> robot{};  ///< of robot.yaml; nothing if the folder has none
  std::optional<Calibration> odometry{};    ///< estimated from the lap; empty in folders of older maps
};

/// Reads map.yaml, a route (empty: route.yaml; else route-NAME.yaml) and robot.yaml. Fails, with the file,
/// on a folder without a map or that route, and on a route of another map.
[[nodiscard]] Result<MapFolder> read_map_folder(const std::filesystem::path& folder,
                                                const std::string& route = {});
/// The same without robot.yaml, for a robot that is described elsewhere.
[[nodiscard]] Result<MapFolder> read_map_and_route(const std::filesystem::path& folder,
                                                   const std::string& route = {});

struct ReplayerSetup {
  LocalizationKind method = LocalizationKind::Riekf;
  RiekfOptions filter{};
  AnchorOptions anchor{};
  std::optional<Calibration> calibration{};  ///< of camera and mounting; its values replace the robot's
  ReplayOptions replay{};                    ///< laps, controller, limits; the lidar mounting is the robot's
};

/// A replayer of the folder's route for this robot, which is expected to start near the route's first point.
/// The lap's odometry calibration is used for a robot of the same name, unless the setup changes it from the
/// default.
[[nodiscard]] Result<std::unique_ptr<Replayer>> make_replayer(const MapFolder& folder,
                                                              const RobotDescription& robot,
                                                              const ReplayerSetup& setup = {});
/// The same for the robot of the folder. Fails (NotFound) if the folder contains no robot.yaml.
[[nodiscard]] Result<std::unique_ptr<Replayer>> make_replayer(const MapFolder& folder,
                                                              const ReplayerSetup& setup = {});

}  // namespace waymark
