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

/// Cameras on bodies that observe tags on bodies, represented as plain values. Examples are a robot's rig of
/// cameras among tags on walls, and fixed cameras that observe a wand. No floor is required.
namespace waymark {

/// A prior on a pose a_T_b: the mean, and the matrix W of the error W log(mean^-1 X), translation first. The
/// error is in the axes of b, the natural frame for measurements made by hand.
struct ScenePrior {
  SE3 mean{};
  Matrix6 sqrt_information = Matrix6::Identity();

  [[nodiscard]] static ScenePrior of(const SE3& mean, const Eigen::Vector3d& sigma_m,
                                     const Eigen::Vector3d& sigma_rad);
  /// The prior in the left tangent, as required by PriorTerm.
  [[nodiscard]] PosePriorFactor factor() const;
  /// The 6x6 covariance in the left tangent; a direction without information has a standard deviation of 1e3.
  [[nodiscard]] Matrix6 covariance() const;
};

struct SceneTag {
  TagId id{};
  double size_m = 0;
  std::optional<ScenePrior> body_T_tag{};
};

/// Noise of a body's motion from frame to frame.
struct SceneMotionNoise {
  double sigma_m = 0, sigma_rad = 0;  ///< constant noise, if both are positive
  /// Otherwise, the noise is the effect of an acceleration over one time step, estimated from the last
  /// motion, within these limits.
  double acceleration_min_m_s2 = 5, acceleration_max_m_s2 = 50;
  double angular_min_rad_s2 = 5, angular_max_rad_s2 = 50;
};

struct SceneBody {
  std::string name{};
  bool is_static = true;
  std::optional<ScenePrior> map_T_body{};  ///< for static bodies only
  /// Size of unlisted tags found on this body; 0 if unlisted tags are not accepted.
  double default_tag_size_m = 0;
  std::vector<SceneTag> tags{};
  std::set<int> ignored{};           ///< ids on this body to ignore
  std::optional<int> max_hamming{};  ///< detections with more corrected bits are ignored
  SE3 body_T_odom{};                 ///< pose of the body's odometry sensor
  std::string odometry_frame{};      ///< child frame of the body's odometry; empty if it has none
  SceneMotionNoise odometry{};       ///< noise of the odometry
  /// Standard deviation of the body's motion from frame to frame.
  std::optional<SceneMotionNoise> stays_put{};
};

struct CameraOnBody {
  std::string name{};
  std::string topic{};  ///< topic of the camera's detections
  CameraModel model;
  std::size_t body = 0;  ///< the body that the camera is mounted on
  std::optional<ScenePrior> body_T_cam{};
  /// Motion of the camera on its body from frame to frame (model tagslam only).
  double wiggle_m = 0, wiggle_rad = 0;
  /// Readout time of a rolling shutter, from the first row to the last; 0 for a global shutter.
  double readout_s = 0;
  /// Standard deviations of the camera parameters (see intrinsics_of), which are estimated with these priors;
  /// empty if the parameters are exact.
  Eigen::VectorXd intrinsics_sigma{};
};

/// A distance between two tags, measured at their centres (corner -1) or corners (0 … 3: TL, TR, BR, BL).
struct SceneDistance {
  int tag_a = 0, tag_b = 0;
  int corner_a = 0, corner_b = 0;
  double measured_m = 0, sigma_m = 0.01;
};

/// The coordinate of a tag's centre (corner -1) or of one of its corners along a direction in the map.
struct SceneCoordinate {
  int tag = 0;
  int corner = -1;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double measured_m = 0, sigma_m = 0.01;
};

/// An axis of a tag that is parallel or antiparallel to a direction in the map.
struct SceneDirection {
  int tag = 0;
  DirectionFactor factor{};
};

/// Tags whose centres and normals are constrained to one plane of unknown pose.
struct ScenePlane {
  std::vector<int> tags{};
  double sigma_m = 0.005, sigma_rad = 0.02;
};

/// Detections of an id that are to be ignored: all of them, those of one camera, or those at one time.
struct SceneSquash {
  std::optional<SensorTime> stamp{};
  std::string camera{};  ///< empty for all cameras
  std::set<int> ids{};
};

/// During this time, an id refers to another tag, because two prints have this id.
struct SceneRemap {
  int id = 0, becomes = 0;
  SensorTime from{}, to{};
  std::string camera{};  ///< empty for all cameras
};

struct TagScene {
  std::vector<CameraOnBody> cameras{};
  std::vector<SceneBody> bodies{};
  std::optional<std::size_t> default_body{};  ///< the body of unlisted tags; empty if they are ignored
  double pixel_sigma_px = 1;
  double min_tag_area_px2 = 0;
  int max_hamming = 2;
  bool approximate_sync = false;  ///< whether images with different stamps can form a frame
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
  std::vector<SceneFrame> frames{};  ///< with ascending stamps
  std::vector<SceneOdometry> odometry{};
  /// Whether a frame's odometry is the sample nearest in time, as in TagSLAM, instead of an interpolated
  /// pose.
  bool nearest_odometry = false;
};

/// Gives all tags one family, for scenes and recordings whose files may not contain it and were read as
/// tag36h11: the recording's own family, if that is another one, else usual_family() of the largest id.
/// Changes nothing if the recording has several families.
void unify_family(TagScene& scene, SceneRecording& recording);

/// Groups views into frames; the views can be in any order of cameras. Views with equal stamps form a frame.
/// With `approximate`, a view of the first camera and the nearest view of each other camera, at most half a
/// period away, form a frame. The remaining views are dropped.
[[nodiscard]] std::vector<SceneFrame> group_views(std::vector<std::pair<SensorTime, SceneView>> views,
                                                  bool approximate);

}  // namespace waymark
