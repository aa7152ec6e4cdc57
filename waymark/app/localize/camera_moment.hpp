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

/// Camera poses without a robot, with a common corner error that is estimated from residuals.
namespace waymark {

/// The tags in one image that were used for a pose, and that pose.
struct PosedTags {
  std::vector<TagDetection> detections{};
  SE3 cam_T_map{};
};

/// Standard deviation [px] of an additional error in all corner coordinates, on top of their covariances. It
/// covers errors that the detector cannot observe, caused by video compression, the lens, the printed tags,
/// or the map. These errors are assumed to be independent with equal variance. The result makes the sum of
/// squared normalised residuals equal to its expectation (method of moments). It is 0 if no additional error
/// is needed, or if there are fewer than 20 redundant residuals. O(tags).
[[nodiscard]] double common_corner_error_px(const std::vector<PosedTags>& images, const TagMap& map,
                                            const CameraModel& camera);

/// Adds an error with this standard deviation to the corner covariances in an image.
[[nodiscard]] TagFrame with_corner_error(TagFrame frame, double sigma_px);

/// A camera pose computed from the tags in one image. The camera body has x forward, y left, z up
/// (body_R_optical()).
struct CameraMoment {
  SensorTime stamp{};  ///< since 1970 for a live camera, since the first image for a video
  Duration age{};      ///< CameraImage::age for a live camera
  int tags = 0;        ///< number of map tags used for the pose or, without a pose, of detected tags
  std::vector<std::size_t> used{};  ///< indices of these tags in the image's detections, ascending
  /// `nullopt` if no map tag was detected, or if the pose is ambiguous.
  std::optional<Uncertain<SE3>> map_T_body{};
  const char* why = "";  ///< the reason why there is no pose although tags were detected
};

/// Computes the pose from the tags in one global-shutter image.
[[nodiscard]] CameraMoment camera_moment(const TagFrame& frame, const TagMap& map, const CameraModel& camera);

/// Computes the poses of a live camera, image by image. The corner error (common_corner_error_px()) is
/// estimated from the last 100 images with a pose. O(1) per image.
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
  int since_ = 0;  ///< number of images with a pose since the last update
  double corner_error_px_ = 0;
};

/// Poses for all images in a video.
struct CameraMoments {
  std::vector<CameraMoment> moments{};  ///< one entry per image
  /// Corner error [px], estimated from the residuals in all images (common_corner_error_px()). It is included
  /// in the covariances of the poses.
  double corner_error_px = 0;
};

/// Computes poses for images with ascending timestamps. `readout_s` is the readout time of a rolling shutter
/// from the first row to the last (negative if rows are read from the bottom, 0 for a global shutter). Each
/// corner is used at the time its row was read. The motion is computed from the previous and the next pose
/// within 0.25 s; its covariance is not included in the covariances of the poses. O(images).
[[nodiscard]] CameraMoments camera_moments(const std::vector<TagFrame>& frames, const TagMap& map,
                                           const CameraModel& camera, double readout_s);

/// The message to be recorded and published. The moment must have a pose.
[[nodiscard]] ros2::PoseWithCovarianceStamped pose_message(const CameraMoment& moment);

/// The camera for a job without a robot. Fails if no calibration file is specified.
[[nodiscard]] Result<DescribedCamera> read_given_camera(const CameraDescription& camera);

/// Fails if the map contains only points.
[[nodiscard]] Status check_tag_poses(const TagMap& map, const std::string& source);

/// A detector for the tag families in the map, which must contain at least one tag.
[[nodiscard]] Result<TagFinder> tag_finder_for(const TagMap& map);

}  // namespace waymark
