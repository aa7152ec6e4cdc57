#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/mapping/lap/bundle_map.hpp"
#include "waymark/mapping/lap/landmark_map.hpp"
#include "waymark/mapping/lap/map_checks.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/samples/route.hpp"

namespace waymark {

/// How tags are placed.
enum class MapMethod : std::uint8_t {
  Bundle,  ///< map_by_bundle()
  Chain,   ///< map_by_chain()
};

struct MapLapOptions {
  MapMethod method = MapMethod::Bundle;
  ChainOptions chain{};
  BundleMapOptions bundle{};
  RouteOptions route{};
  std::optional<LapPrior> prior{};  ///< a map that the lap is to improve; bundle only
};

/// The names of the methods, as parse_map_method() takes them.
[[nodiscard]] std::vector<std::string> map_methods();
[[nodiscard]] std::string_view to_string(MapMethod method);
/// Fails (InvalidArgument, with a suggestion) on a name that is none of them.
[[nodiscard]] Result<MapMethod> parse_map_method(std::string_view name);

/// What optimising says beside the map.
struct BundleFigures {
  TagMap start_map{};  ///< by the chain, before anything was optimised
  Trajectory start_trajectory{};
  int iterations = 0;
  double rms_px = 0;
  double noise_ratio = 1;
  double correlated_frames = 1;  ///< so many pictures weigh as one: errors of corners last
  std::size_t rejected = 0;
  std::map<TagId, LeftOutCounts> left_out{};  ///< of them, those of each tag, by reason
  OdometryScales odometry_scales{};
  OdometryScales odometry_scales_sigma{};
  int prior_agreeing = 0;  ///< tags that stand where the map that is extended has them
  double moved_m = 0;      ///< how far from the chain's place the tag is that moved most
  std::optional<LoopClosure> loop{};
  std::optional<MountingEstimate> mounting{};  ///< where the camera sits by what the lap says
  bool mounting_used = false;                  ///< the map rests on it
  std::optional<TurnNoise> turn_noise{};       ///< of the wheels as they were recorded
  bool turns_by_gyro = false;                  ///< the wheels' own turns agreed with the tags clearly worse
  double without_gyro_share = 0;               ///< of the lap; 1 without any gyro
};

/// What a lap becomes.
struct MappedLap {
  TagMap map{};
  std::map<TagId, int> observations{};  ///< observations of each tag of the map that were used
  Trajectory trajectory{};
  /// Of each pose of the trajectory, left tangent in map; empty: not known.
  std::vector<Matrix6> trajectory_covariance{};
  Route route{};
  double route_repeated_m = 0;  ///< of the lap, not in the route because it repeats the route
  int frames = 0;
  int frames_without_pose = 0;
  std::vector<std::string> warnings{};  ///< what is missing or doubtful, in words
  std::optional<BundleFigures> bundle{};
};

/// What a taught lap consists of.
struct TaughtLap {
  std::vector<TagFrame> frames{};
  std::vector<Odometry> odometry{};  ///< may be empty: then tags alone say where the robot was
  std::vector<ImuSample> imu{};      ///< may be empty
};

/// The map phase: a taught lap in, a map of the tags, the way the base went and a route out. Fails with
/// MapMethod::Chain where a map is to be extended, on a lap without frames, without the anchor, or too short
/// for a route.
[[nodiscard]] Result<MappedLap> map_lap(const TaughtLap& taught, const TeachSetup& setup,
                                        const MapLapOptions& options = {}, const MapProgress& progress = {});

/// A lap of a robot whose own software places tags before its camera and keeps no corners.
struct PoseLap {
  std::vector<TagPoseFrame> frames{};
  std::vector<Odometry> odometry{};
  SE3 base_T_cam{};
  TagSizes sizes{};  ///< for the map only: poses need none
};

struct MapPosesOptions {
  LandmarkMapOptions points{};
  RouteOptions route{};
};

/// What only such a lap says.
struct PoseLapFigures {
  OdometryScales scales{};
  OdometryScales scales_sigma{};
  SE2 base_X_assumed{};  ///< how far the camera is from where it is assumed to sit
  Eigen::Vector3d mounting_sigma = Eigen::Vector3d::Zero();
  double rms_m = 0;
};
struct MappedPoseLap {
  MappedLap lap{};
  PoseLapFigures figures{};
  TagId anchor{};  ///< the tag that is known best
};

/// Map, way and route from poses of tags and odometry: places in the plane as map_landmarks() finds them,
/// heights and directions by what most observations agree on. The map's frame is the base where the lap
/// began. A tag in the middle of another (nested tags) is left out and said. Fails as map_landmarks() and
/// build_route() do.
[[nodiscard]] Result<MappedPoseLap> map_pose_lap(const PoseLap& lap, const MapPosesOptions& options = {});

}  // namespace waymark
