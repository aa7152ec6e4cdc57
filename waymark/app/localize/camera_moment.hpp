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

/// What corners err by beyond their covariances.
namespace waymark {

/// The tags of one image used for a pose, and that pose.
struct PosedTags {
  std::vector<TagDetection> detections{};
  SE3 cam_T_map{};
};

/// A standard deviation that all corner coordinates of these pictures have besides their covariances
/// [px]: what a video's compression, the lens, the print of the tags and the map do to them, which their
/// detector cannot see. Taken as independent and alike; such that the sum of the squared normalised residuals
/// is as large as it should be (method of moments). 0 where it is without it, or where fewer than 20
/// residuals are left over. O(tags).
[[nodiscard]] double common_corner_error_px(const std::vector<PosedTags>& pictures, const TagMap& map,
                                            const CameraModel& camera);

/// The tags of a picture with such an error in their covariances.
[[nodiscard]] TagFrame with_corner_error(TagFrame frame, double sigma_px);

// Poses of a camera without a robot, hand-held or on a tripod, in six degrees of freedom.

/// Where a camera was by the tags of one picture. Its body has x forward, y left, z up (body_R_optical()).
struct CameraMoment {
  SensorTime stamp{};               ///< of a live camera since 1970, of a video since its first picture
  Duration age{};                   ///< of a live camera: CameraPicture::age
  int tags = 0;                     ///< map tags used for the pose; without a pose: detected tags
  std::vector<std::size_t> used{};  ///< those, as indices of the picture's detections, ascending
  /// Nothing if no map tag was detected, or if the pose is ambiguous.
  std::optional<Uncertain<SE3>> map_T_body{};
  const char* why = "";  ///< reason if there is no pose although tags were detected
};

/// The pose by the tags of one picture of a global shutter.
[[nodiscard]] CameraMoment camera_moment(const TagFrame& frame, const TagMap& map, const CameraModel& camera);

/// The poses of a live camera's pictures, one after the other, with what corners err by beyond what their
/// detector says (common_corner_error_px()) as the last hundred pictures with a pose have it. O(1) each.
class LiveMoments {
 public:
  /// Both outlive it.
  LiveMoments(const TagMap& map, const CameraModel& camera) : map_(&map), camera_(&camera) {}

  [[nodiscard]] CameraMoment of(const TagFrame& frame);
  [[nodiscard]] double corner_error_px() const { return corner_error_px_; }

 private:
  const TagMap* map_;
  const CameraModel* camera_;
  std::deque<PosedTags> last_{};
  int since_ = 0;  ///< pictures since the last update
  double corner_error_px_ = 0;
};

/// The poses of all pictures of a video.
struct CameraMoments {
  std::vector<CameraMoment> moments{};  ///< one a picture
  /// Error of a corner coordinate beyond the detector's standard deviation [px], from the residuals of all
  /// pictures have it (common_corner_error_px()); it is in the poses' covariances.
  double corner_error_px = 0;
};

/// Of pictures with ascending stamps. With a rolling shutter of `readout_s` (first row
/// to last; negative from the bottom; 0: global) each corner counts at the time of its own row, with the
/// motion between the poses before and after, within 0.25 s; the covariance of that motion
/// is not part of the poses'. O(pictures).
[[nodiscard]] CameraMoments camera_moments(const std::vector<TagFrame>& frames, const TagMap& map,
                                           const CameraModel& camera, double readout_s);

/// As it is recorded and published. The moment has a pose.
[[nodiscard]] ros2::PoseWithCovarianceStamped pose_message(const CameraMoment& moment);

/// The camera of a job without a robot. Fails where no file is given.
[[nodiscard]] Result<DescribedCamera> read_given_camera(const CameraDescription& camera);

/// Fails on a map that has points only.
[[nodiscard]] Status check_tag_poses(const TagMap& map, const std::string& source);

/// A detector of the families that are in the map, which has tags.
[[nodiscard]] Result<TagFinder> tag_finder_for(const TagMap& map);

}  // namespace waymark
