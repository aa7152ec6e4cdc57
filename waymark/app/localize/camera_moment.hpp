#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/base/time.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/tags/tag_finder.hpp"

/// Poses of a camera without a robot, with a common corner error estimated from residuals.
namespace waymark {

/// The tags of one image used for a pose, and that pose.
struct PosedTags {
  std::vector<TagDetection> detections{};
  SE3 cam_T_map{};
};

/// Standard deviation [px] of an additional error of all corner coordinates, on top of their covariances. It
/// covers errors that the detector cannot observe, caused by video compression, lens, printed tags, and map.
/// The errors are assumed independent with equal variance. The result makes the sum of squared normalised
/// residuals equal to its expectation (method of moments). 0 if no such error is needed, or with fewer than
/// 20 redundant residuals. O(tags).
[[nodiscard]] double common_corner_error_px(const std::vector<PosedTags>& images, const TagMap& map,
                                            const CameraModel& camera);

/// Adds this error to the corner covariances in an image.
[[nodiscard]] TagFrame with_corner_error(TagFrame frame, double sigma_px);

/// Pose of a camera from the tags of one image. The camera body has x forward, y left, z up
/// (body_R_optical()).
struct CameraMoment {
  SensorTime stamp{};               ///< live camera: since 1970; video: since its first image
  Duration age{};                   ///< live camera: CameraPicture::age
  int tags = 0;                     ///< map tags used for the pose; without a pose: detected tags
  std::vector<std::size_t> used{};  ///< indices of the tags used, ascending, in the image's detections
  /// Nothing if no map tag was detected, or if the pose is ambiguous.
  std::optional<Uncertain<SE3>> map_T_body{};
  const char* why = "";  ///< why there is no pose although tags were detected
};

/// Pose from the tags of one global-shutter image.
[[nodiscard]] CameraMoment camera_moment(const TagFrame& frame, const TagMap& map, const CameraModel& camera);

/// Poses of a live camera, image by image. The corner error (common_corner_error_px()) is estimated from the
/// last 100 images with a pose. O(1) per image.
class LiveMoments {
 public:
  /// Both arguments must outlive this object.
  LiveMoments(const TagMap& map, const CameraModel& camera) : map_(&map), camera_(&camera) {}

  [[nodiscard]] CameraMoment of(const TagFrame& frame);
  [[nodiscard]] double corner_error_px() const { return corner_error_px_; }

 private:
  const TagMap* map_;
  const CameraModel* camera_;
  std::deque<PosedTags> last_{};
  int since_ = 0;  ///< images since the last update
  double corner_error_px_ = 0;
};

/// Poses of all images of a video.
struct CameraMoments {
  std::vector<CameraMoment> moments{};  ///< one per image
  /// Corner error from the residuals of all images [px] (common_corner_error_px()); included in the
  /// covariances of the poses.
  double corner_error_px = 0;
};

/// Poses of images with ascending stamps. `readout_s` is the readout time of a rolling shutter from the first
/// row to the last (negative: from the bottom; 0: global shutter). Each corner is used at the time of its
/// row, with the motion between the previous and the next pose within 0.25 s. The covariance of that motion
/// is not included in the covariances of the poses. O(images).
[[nodiscard]] CameraMoments camera_moments(const std::vector<TagFrame>& frames, const TagMap& map,
                                           const CameraModel& camera, double readout_s);

/// The message that is recorded and published. The moment must have a pose.
[[nodiscard]] ros2::PoseWithCovarianceStamped pose_message(const CameraMoment& moment);

/// The camera for a job without a robot. Fails if no calibration file is given.
[[nodiscard]] Result<DescribedCamera> read_given_camera(const CameraDescription& camera);

/// Fails on a map that contains only points.
[[nodiscard]] Status check_tag_poses(const TagMap& map, const std::string& source);

/// A detector for the tag families in the map, which must contain tags.
[[nodiscard]] Result<TagFinder> tag_finder_for(const TagMap& map);

}  // namespace waymark
