#pragma once

#include "waymark/mapping/lap/landmark_map.hpp"
#include "waymark/pipeline/lap_mapper.hpp"

namespace waymark {

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
