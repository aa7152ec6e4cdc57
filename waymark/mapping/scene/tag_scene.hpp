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

/// Cameras on bodies that observe tags on bodies, as plain values. Examples are a robot's rig of cameras
/// among tags on walls, and fixed cameras that observe a wand. No floor is required.
namespace waymark {

/// Prior of a pose a_T_b: the mean, and W of the error W log(mean^-1 X), translation first. The error is in
/// the axes of b, the natural frame of a measurement by hand.
struct ScenePrior {
  SE3 mean{};
  Matrix6 sqrt_information = Matrix6::Identity();

  [[nodiscard]] static ScenePrior of(const SE3& mean, const Eigen::Vector3d& sigma_m,
                                     const Eigen::Vector3d& sigma_rad);
  /// In the left tangent, as PriorTerm requires.
  [[nodiscard]] PosePriorFactor factor() const;
  /// 6x6 in the left tangent; a direction without information has a standard deviation of 1e3.
  [[nodiscard]] Matrix6 covariance() const;
};

struct SceneTag {
  TagId id{};
  double size_m = 0;
  std::optional<ScenePrior> body_T_tag{};
};

/// Noise of the motion of a body from frame to frame.
struct SceneMotionNoise {
  double sigma_m = 0, sigma_rad = 0;  ///< constant, if both are positive
  /// Otherwise the effect on one time step of an acceleration estimated from the last motion, within these
  /// limits.
  double acceleration_min_m_s2 = 5, acceleration_max_m_s2 = 50;
  double angular_min_rad_s2 = 5, angular_max_rad_s2 = 50;
};

struct SceneBody {
  std::string name{};
  bool is_static = true;
  std::optional<ScenePrior> map_T_body{};  ///< static bodies only
  double default_tag_size_m = 0;  ///< size of unlisted tags found on it; 0: unlisted tags are not accepted
  std::vector<SceneTag> tags{};
  std::set<int> ignored{};                      ///< ids on it to ignore
  std::optional<int> max_hamming{};             ///< detections with more corrected bits are ignored
  SE3 body_T_odom{};                            ///< pose of its odometry sensor
  std::string odometry_frame{};                 ///< child frame of its odometry; empty: it has none
  SceneMotionNoise odometry{};                  ///< noise of that odometry
  std::optional<SceneMotionNoise> stays_put{};  ///< standard deviation of its motion from frame to frame
};

struct CameraOnBody {
  std::string name{};
  std::string topic{};  ///< topic of its detections
  CameraModel model;
  std::size_t body = 0;  ///< the body it is mounted on
  std::optional<ScenePrior> body_T_cam{};
  double wiggle_m = 0, wiggle_rad = 0;  ///< motion on its body from frame to frame (model tagslam only)
  double readout_s = 0;  ///< readout time of a rolling shutter, first row to last; 0: global shutter
  /// Standard deviations of the camera parameters (intrinsics_of), which are estimated with these priors;
  /// empty: exact.
  Eigen::VectorXd intrinsics_sigma{};
};

/// The distance between the centres (corner -1) or corners (0 … 3: TL, TR, BR, BL) of two tags.
struct SceneDistance {
  int tag_a = 0, tag_b = 0;
  int corner_a = 0, corner_b = 0;
  double measured_m = 0, sigma_m = 0.01;
};

/// Coordinate of a tag's centre (corner -1) or corner along a direction of the map.
struct SceneCoordinate {
  int tag = 0;
  int corner = -1;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double measured_m = 0, sigma_m = 0.01;
};

/// An axis of a tag that is parallel or antiparallel to a direction of the map.
struct SceneDirection {
  int tag = 0;
  DirectionFactor factor{};
};

/// Tags in one plane of unknown pose: their centres and their normals.
struct ScenePlane {
  std::vector<int> tags{};
  double sigma_m = 0.005, sigma_rad = 0.02;
};

/// Detections of an id to ignore: everywhere, by one camera, or at one time.
struct SceneSquash {
  std::optional<SensorTime> stamp{};
  std::string camera{};  ///< empty: all
  std::set<int> ids{};
};

/// During this time an id stands for another tag, because two prints have this id.
struct SceneRemap {
  int id = 0, becomes = 0;
  SensorTime from{}, to{};
  std::string camera{};  ///< empty: all
};

struct TagScene {
  std::vector<CameraOnBody> cameras{};
  std::vector<SceneBody> bodies{};
  std::optional<std::size_t> default_body{};  ///< body of unlisted tags; empty: they are ignored
  double pixel_sigma_px = 1;
  double min_tag_area_px2 = 0;
  int max_hamming = 2;
  bool approximate_sync = false;  ///< images with different stamps form a frame
  std::vector<SceneDistance> distances{};
  std::vector<SceneCoordinate> coordinates{};
  std::vector<SceneDirection> directions{};
  std::vector<ScenePlane> planes{};
  std::vector<SceneSquash> squash{};
  std::vector<SceneRemap> remaps{};

  [[nodiscard]] std::optional<std::size_t> body_named(const std::string& name) const;
};

/// The detections of one camera.
struct SceneView {
  std::size_t camera = 0;
  std::vector<TagDetection> detections{};
};

/// The detections of all cameras at one time.
struct SceneFrame {
  SensorTime stamp{};
  std::vector<SceneView> views{};
};

/// Pose of a body's odometry sensor in a drifting frame.
struct SceneOdometry {
  SensorTime stamp{};
  std::size_t body = 0;
  SE3 odom_T_sensor{};
};

struct SceneRecording {
  std::vector<SceneFrame> frames{};  ///< stamps ascending
  std::vector<SceneOdometry> odometry{};
  /// A frame's odometry is the sample nearest in time, as in TagSLAM, instead of an interpolated one.
  bool nearest_odometry = false;
};

/// Groups views in any order of cameras into frames. Views with equal stamps form a frame. With
/// `approximate`, a view of the first camera and the nearest view of each other camera, at most half a period
/// away, form a frame. The remaining views are dropped.
[[nodiscard]] std::vector<SceneFrame> group_views(std::vector<std::pair<SensorTime, SceneView>> views,
                                                  bool approximate);

}  // namespace waymark
