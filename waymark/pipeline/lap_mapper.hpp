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

/// Method that estimates the tag poses.
enum class MapMethod : std::uint8_t {
  Bundle,  ///< map_by_bundle()
  Chain,   ///< map_by_chain()
};

struct MapLapOptions {
  MapMethod method = MapMethod::Bundle;
  ChainOptions chain{};
  BundleMapOptions bundle{};
  RouteOptions route{};
  std::optional<LapPrior> prior{};  ///< the map that the lap extends; bundle only
};

/// Names that parse_map_method() accepts.
[[nodiscard]] std::vector<std::string> map_methods();
[[nodiscard]] std::string_view to_string(MapMethod method);
/// Fails (InvalidArgument, with a suggestion) on an unknown name.
[[nodiscard]] Result<MapMethod> parse_map_method(std::string_view name);

/// Results of the bundle adjustment in addition to the map.
struct BundleFigures {
  TagMap start_map{};  ///< by the chain, before the optimisation
  Trajectory start_trajectory{};
  int iterations = 0;
  double rms_px = 0;
  double noise_ratio = 1;
  double correlated_frames = 1;  ///< number of images that weigh as one, because corner errors are correlated
  std::size_t rejected = 0;
  std::map<TagId, RejectionCounts> left_out{};  ///< rejected observations per tag, by reason
  OdometryScales odometry_scales{};
  OdometryScales odometry_scales_sigma{};
  int prior_agreeing = 0;  ///< tags consistent with the map that is extended
  double moved_m = 0;      ///< largest distance of a tag from its position by the chain
  std::optional<LoopClosure> loop{};
  std::optional<MountingEstimate> mounting{};  ///< camera mounting as estimated from the lap
  bool mounting_used = false;                  ///< the map uses it
  std::optional<TurnNoise> turn_noise{};       ///< of the wheels as recorded
  bool turns_by_gyro = false;                  ///< the turns by wheels agreed clearly worse with the tags
  double without_gyro_share = 0;               ///< share of the lap; 1 without a gyro
};

/// Result of mapping a lap.
struct MappedLap {
  TagMap map{};
  std::map<TagId, int> observations{};  ///< number of observations of each map tag that were used
  Trajectory trajectory{};
  /// Covariance of each pose of the trajectory, left tangent in map; empty: unknown.
  std::vector<Matrix6> trajectory_covariance{};
  Route route{};
  double route_repeated_m = 0;  ///< length of the lap that is not in the route because it repeats the route
  int frames = 0;
  int frames_without_pose = 0;
  std::vector<std::string> warnings{};  ///< warnings of missing or uncertain results
  std::optional<BundleFigures> bundle{};
};

/// Input data of a taught lap.
struct TaughtLap {
  std::vector<TagFrame> frames{};
  std::vector<Odometry> odometry{};  ///< may be empty; the trajectory is then estimated from tags alone
  std::vector<ImuSample> imu{};      ///< may be empty
};

/// Maps a taught lap: estimates a map of the tags, the trajectory of the base, and a route. Fails with
/// MapMethod::Chain if a map is to be extended, and on a lap without frames, without the anchor, or too short
/// for a route.
[[nodiscard]] Result<MappedLap> map_lap(const TaughtLap& taught, const TeachSetup& setup,
                                        const MapLapOptions& options = {}, const MapProgress& progress = {});

/// A lap of a robot whose own software estimates tag poses and records no corners.
struct PoseLap {
  std::vector<TagPoseFrame> frames{};
  std::vector<Odometry> odometry{};
  SE3 base_T_cam{};
  TagSizes sizes{};  ///< for the map only; poses do not need it
};

struct MapPosesOptions {
  LandmarkMapOptions points{};
  RouteOptions route{};
};

/// Results that only a lap of tag poses has.
struct PoseLapFigures {
  OdometryScales scales{};
  OdometryScales scales_sigma{};
  SE2 base_X_assumed{};  ///< correction of the assumed camera mounting
  Eigen::Vector3d mounting_sigma = Eigen::Vector3d::Zero();
  double rms_m = 0;
};
struct MappedPoseLap {
  MappedLap lap{};
  PoseLapFigures figures{};
  TagId anchor{};  ///< the tag with the smallest uncertainty
};

/// Estimates map, trajectory and route from tag poses and odometry: positions in the plane by
/// map_landmarks(), heights and orientations by the consensus of observations. The map frame is the base at
/// the start of the lap. A tag in the middle of another one (nested tags) is excluded with a warning. Fails
/// as map_landmarks() and build_route() do.
[[nodiscard]] Result<MappedPoseLap> map_pose_lap(const PoseLap& lap, const MapPosesOptions& options = {});

}  // namespace waymark
