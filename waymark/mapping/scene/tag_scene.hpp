#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/factors/pose_factors.hpp"
#include "waymark/samples/robot_samples.hpp"

/// Cameras on bodies that look at tags on bodies, as plain values: a robot's rig of cameras among tags on
/// walls, fixed cameras that watch a wand, both at once. No floor is needed.
namespace waymark {

/// What is known of a pose a_T_b beforehand: mean, and W of the error W log(mean^-1 X), translation first, in
/// the axes of b (where whoever measures by hand thinks).
struct ScenePrior {
  SE3 mean{};
  Matrix6 sqrt_information = Matrix6::Identity();

  [[nodiscard]] static ScenePrior of(const SE3& mean, const Eigen::Vector3d& sigma_m,
                                     const Eigen::Vector3d& sigma_rad);
  /// In the left tangent, as PriorTerm wants it.
  [[nodiscard]] PosePriorFactor factor() const;
  /// 6x6 in the left tangent; a direction that is not known gets a standard deviation of 1e3.
  [[nodiscard]] Matrix6 covariance() const;
};

struct SceneTag {
  TagId id{};
  double size_m = 0;
  std::optional<ScenePrior> body_T_tag{};
};

/// How the motion of a body is measured from frame to frame.
struct SceneMotionNoise {
  double sigma_m = 0, sigma_rad = 0;  ///< constant, if both are positive
  /// Otherwise what an acceleration that the last motion did not foretell makes of a time step, within these.
  double acceleration_min_m_s2 = 5, acceleration_max_m_s2 = 50;
  double angular_min_rad_s2 = 5, angular_max_rad_s2 = 50;
};

struct SceneBody {
  std::string name{};
  bool is_static = true;
  std::optional<ScenePrior> map_T_body{};  ///< static bodies only
  double default_tag_size_m = 0;           ///< of tags that are found on it; 0: none can be
  std::vector<SceneTag> tags{};
  std::set<int> ignored{};                      ///< ids that are on it and shall not count
  std::optional<int> max_hamming{};             ///< detections with more corrected bits do not count
  SE3 body_T_odom{};                            ///< where its odometry is measured
  std::string odometry_frame{};                 ///< child frame of its odometry; empty: it has none
  SceneMotionNoise odometry{};                  ///< of that odometry
  std::optional<SceneMotionNoise> stays_put{};  ///< from frame to frame it moves no farther than this (sigma)
};

struct CameraOnBody {
  std::string name{};
  std::string topic{};  ///< of its detections
  CameraModel model;
  std::size_t body = 0;  ///< it sits on
  std::optional<ScenePrior> body_T_cam{};
  double wiggle_m = 0, wiggle_rad = 0;  ///< how it moves on its body from frame to frame (model tagslam only)
  double readout_s = 0;                 ///< of a rolling shutter, first row to last; 0: global shutter
  /// Standard deviations of the model's numbers (intrinsics_of): it is adjusted within them; empty: exact.
  Eigen::VectorXd intrinsics_sigma{};
};

/// The distance between the centres (corner -1) or corners (0 … 3: TL, TR, BR, BL) of two tags.
struct SceneDistance {
  int tag_a = 0, tag_b = 0;
  int corner_a = 0, corner_b = 0;
  double measured_m = 0, sigma_m = 0.01;
};

/// Where a tag's centre (corner -1), or a corner of it, lies along a direction of the map.
struct SceneCoordinate {
  int tag = 0;
  int corner = -1;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double measured_m = 0, sigma_m = 0.01;
};

/// An axis of a tag that points along a direction of the map, or against it.
struct SceneDirection {
  int tag = 0;
  DirectionFactor factor{};
};

/// Tags that lie in one plane, wherever it is: their centres and their directions.
struct ScenePlane {
  std::vector<int> tags{};
  double sigma_m = 0.005, sigma_rad = 0.02;
};

/// Detections of an id that are to be passed over: everywhere, by one camera, at one time.
struct SceneSquash {
  std::optional<SensorTime> stamp{};
  std::string camera{};  ///< empty: all
  std::set<int> ids{};
};

/// While this lasts an id is another: two prints of one tag.
struct SceneRemap {
  int id = 0, becomes = 0;
  SensorTime from{}, to{};
  std::string camera{};  ///< empty: all
};

struct TagScene {
  std::vector<CameraOnBody> cameras{};
  std::vector<SceneBody> bodies{};
  std::optional<std::size_t> default_body{};  ///< that tags on no list belong to; nothing: they do not count
  double pixel_sigma_px = 1;
  double min_tag_area_px2 = 0;
  int max_hamming = 2;
  bool approximate_sync = false;  ///< pictures of different stamps belong together
  std::vector<SceneDistance> distances{};
  std::vector<SceneCoordinate> coordinates{};
  std::vector<SceneDirection> directions{};
  std::vector<ScenePlane> planes{};
  std::vector<SceneSquash> squash{};
  std::vector<SceneRemap> remaps{};

  [[nodiscard]] std::optional<std::size_t> body_named(const std::string& name) const;
};

/// What one camera saw.
struct SceneView {
  std::size_t camera = 0;
  std::vector<TagDetection> detections{};
};

/// What all cameras saw at a time.
struct SceneFrame {
  SensorTime stamp{};
  std::vector<SceneView> views{};
};

/// Where a body's odometry was, in a frame that drifts.
struct SceneOdometry {
  SensorTime stamp{};
  std::size_t body = 0;
  SE3 odom_T_sensor{};
};

struct SceneRecording {
  std::vector<SceneFrame> frames{};  ///< stamps ascending
  std::vector<SceneOdometry> odometry{};
  bool nearest_odometry =
      false;  ///< a frame's odometry is the sample nearest in time, as in TagSLAM; not in between
};

/// Views one by one in any order of cameras become frames: same stamps together or, with `approximate`, the
/// views of each other camera nearest to a view of the first, at most half a picture's time away; what is
/// left over is dropped.
[[nodiscard]] std::vector<SceneFrame> group_views(std::vector<std::pair<SensorTime, SceneView>> views,
                                                  bool approximate);

}  // namespace waymark
