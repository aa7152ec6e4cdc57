#pragma once

#include <array>
#include <functional>
#include <limits>
#include <vector>

#include "waymark/mapping/camera/camera_calibration.hpp"
#include "waymark/mapping/camera/intrinsics_fit.hpp"

/// Parts of calibrate_camera(): initialisation of the search and evaluation of its result.
namespace waymark::internal {

/// Approximate camera pose for an image, regardless of the noise in its corners, together with its fit error
/// [px].
struct RoughPose {
  SE3 target_T_cam{};
  double rms_px = std::numeric_limits<double>::infinity();
};

/// A camera and its parameter vector.
struct ParametricCamera {
  LensModel lens{};
  Eigen::VectorXd parameters{};
  CameraModel camera;
};

/// Function that estimates the camera pose for an image.
using PoseStart = std::function<RoughPose(std::size_t image, const ParametricCamera& camera)>;

/// Estimates the pose from the tags in an image, some of which may be wrong. `images` and `target` must
/// outlive the result.
[[nodiscard]] PoseStart start_from_tags(const std::vector<std::vector<TagDetection>>& images,
                                        const TagMap& target);
/// Estimates the pose from all points in an image of a flat target (z = 0), using their homography (Zhang,
/// section 3.1). The better of this pose and its reflection about the line of sight is used. `views` must
/// outlive the result.
[[nodiscard]] PoseStart start_from_plane(const std::vector<TargetView>& views);

/// The problem and the current state of the search.
struct Search {
  PoseStart start{};
  FitOptions fit{};
  Eigen::VectorXd parameters{};
  std::vector<TargetView> views{};
};

/// Whether an image shows enough of the target: at least eight points that are not on one line.
[[nodiscard]] bool usable(const TargetView& view);

/// Restarts the search with this lens model. Selects a focal length from a geometric series and estimates the
/// pose for each image. Removes the marks of views without a usable pose.
[[nodiscard]] Status begin_search(Search& search, LensModel lens);

/// Replaces the pose of a view if another pose explains the image better (a distant flat target has two
/// similar-looking poses).
void find_better_poses(Search& search, const ParametricCamera& camera);

/// Squared reprojection errors of the corners in use in a view [px^2].
[[nodiscard]] std::vector<double> squared_distances_px2(const TargetView& view, const CameraModel& camera);
[[nodiscard]] double root_mean(const std::vector<double>& squares);

[[nodiscard]] CalibratedView summary_of(const TargetView& view, const CameraModel& camera);
[[nodiscard]] std::array<ImageRegion, 9> regions_of(const std::vector<TargetView>& views,
                                                    const CameraModel& camera);

}  // namespace waymark::internal
