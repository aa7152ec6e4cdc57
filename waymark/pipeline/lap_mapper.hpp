#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/localization/sensor_diagnosis.hpp"
#include "waymark/mapping/lap/bundle_map.hpp"
#include "waymark/mapping/lap/landmark_map.hpp"
#include "waymark/mapping/lap/map_checks.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/samples/route.hpp"

namespace waymark {

/// How the tag poses are estimated.
enum class MapMethod : std::uint8_t {
  Bundle,  ///< map_by_bundle()
  Chain,   ///< map_by_chain()
};

struct MapLapOptions {
  MapMethod method = MapMethod::Bundle;
  ChainOptions chain{};
  BundleMapOptions bundle{};
  RouteOptions route{};
  std::optional<LapPrior> prior{};  ///< the map to be extended by this lap; only with Bundle
};

/// The names that parse_map_method() accepts.
[[nodiscard]] std::vector<std::string> map_methods();
[[nodiscard]] std::string_view to_string(MapMethod method);
/// Fails (InvalidArgument, with a suggestion) if the name is unknown.
[[nodiscard]] Result<MapMethod> parse_map_method(std::string_view name);

/// Results of the bundle adjustment in addition to the map.
struct BundleFigures {
  TagMap start_map{};  ///< map estimated by the chain, before the optimisation
  Trajectory start_trajectory{};
  int iterations = 0;
  double rms_px = 0;
  double noise_ratio = 1;
  std::vector<WrongSize> wrong_sizes{};    ///< tags whose given size contradicts the observations
  std::vector<MovedTag> moved_tags{};      ///< tags that were moved during the lap
  std::vector<MissingTag> missing_tags{};  ///< tags that were taken away or hidden
  std::vector<TagCut> thin_cuts{};         ///< parts of the map that depend on few observations
  double size_spread = 0;                  ///< relative standard deviation of the other printed sizes
  double size_scale = 1;                   ///< common factor for all tag sizes; 1 if it was not estimated
  double size_scale_sigma = 0;             ///< its standard deviation; 0 if it was not estimated
  double correlated_frames = 1;  ///< number of images that count as one, because their corner errors are
                                 ///< correlated
  std::size_t rejected = 0;
  std::map<TagId, RejectionCounts> left_out{};  ///< number of rejected observations of each tag, by reason
  OdometryScales odometry_scales{};
  OdometryScales odometry_scales_sigma{};
  int prior_agreeing = 0;  ///< number of tags that are consistent with the map to be extended
  double moved_m = 0;      ///< largest distance of a tag from its position estimated by the chain
  std::optional<LoopClosure> loop{};
  std::optional<MountingEstimate> mounting{};  ///< camera mounting as estimated from the lap
  bool mounting_used = false;                  ///< whether the map uses this mounting
  std::optional<TurnNoise> turn_noise{};       ///< noise of the recorded turns of the wheels
  bool turns_by_gyro = false;                  ///< whether the turns according to the wheels agreed clearly
                                               ///< worse with the tags
  double without_gyro_share = 0;               ///< fraction of the lap without gyro data; 1 without a gyro
};

/// Result of mapping a lap.
struct MappedLap {
  TagMap map{};
  std::map<TagId, int> observations{};  ///< number of observations used for each map tag
  Trajectory trajectory{};
  /// Covariance of each pose in the trajectory, in the left tangent space in the map frame; empty if unknown.
  std::vector<Matrix6> trajectory_covariance{};
  Route route{};
  double route_repeated_m = 0;  ///< length of the part of the lap that is omitted from the route because it
                                ///< repeats the beginning
  int frames = 0;
  int frames_without_pose = 0;
  std::vector<std::string> warnings{};  ///< warnings about missing or uncertain results
  std::optional<BundleFigures> bundle{};
  std::vector<SensorFinding> sensors{};  ///< faults of sensors; their messages are among the warnings
};

/// The data recorded during a taught lap.
struct TaughtLap {
  std::vector<TagFrame> frames{};
  std::vector<Odometry> odometry{};  ///< may be empty, in which case the trajectory is estimated from tags
                                     ///< alone
  std::vector<ImuSample> imu{};      ///< may be empty
};

/// Maps a taught lap: estimates a map of the tags, the trajectory of the base, and a route. Faults of sensors
/// that contradict the others are corrected first where that is safe (diagnose_lap()). Fails if
/// MapMethod::Chain should extend a map. Also fails if the lap has no frames, does not contain the anchor,
/// has no second tag that can be mapped, or is too short for a route.
[[nodiscard]] Result<MappedLap> map_lap(const TaughtLap& taught, const TeachSetup& setup,
                                        const MapLapOptions& options = {}, const MapProgress& progress = {});

/// The same without copies of the samples, which take most of the memory that mapping a long recording needs.
/// They are moved during the call and back again before it returns.
[[nodiscard]] Result<MappedLap> map_lap_in_place(TaughtLap& taught, const TeachSetup& setup,
                                                 const MapLapOptions& options = {},
                                                 const MapProgress& progress = {});

/// A lap by a robot whose own software estimates tag poses and does not record corners.
struct PoseLap {
  std::vector<TagPoseFrame> frames{};
  std::vector<Odometry> odometry{};
  SE3 base_T_cam{};
  TagSizes sizes{};  ///< needed only for the map; the poses do not depend on them
};

struct MapPosesOptions {
  LandmarkMapOptions points{};
  RouteOptions route{};
};

/// Results specific to a lap with tag poses.
struct PoseLapFigures {
  OdometryScales scales{};
  OdometryScales scales_sigma{};
  SE2 base_X_assumed{};  ///< correction to the assumed camera mounting
  Eigen::Vector3d mounting_sigma = Eigen::Vector3d::Zero();
  double rms_m = 0;
};
struct MappedPoseLap {
  MappedLap lap{};
  PoseLapFigures figures{};
  TagId anchor{};  ///< the tag whose pose has the smallest uncertainty
};

/// Estimates the map, the trajectory and the route from tag poses and odometry. Positions in the plane are
/// computed by map_landmarks(), heights and orientations by consensus between observations. The map frame is
/// the base frame at the start of the lap. A tag in the centre of another one (nested tags) is excluded, with
/// a warning. Fails as map_landmarks() and build_route() do.
[[nodiscard]] Result<MappedPoseLap> map_pose_lap(const PoseLap& lap, const MapPosesOptions& options = {});

}  // namespace waymark
