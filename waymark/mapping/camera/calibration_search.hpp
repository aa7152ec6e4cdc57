#pragma once

#include <array>
#include <functional>
#include <limits>
#include <vector>

#include "waymark/mapping/camera/camera_calibration.hpp"
#include "waymark/mapping/camera/intrinsics_fit.hpp"

/// The parts of calibrate_camera(): where the search begins, and how its end is judged.
namespace waymark::internal {

/// Where a camera must stand to see a picture, whatever its corners' noise; how badly it fits [px].
struct RoughPose {
  SE3 target_T_cam{};
  double rms_px = std::numeric_limits<double>::infinity();
};

/// A camera by its numbers.
struct NumberedCamera {
  LensModel lens{};
  Eigen::VectorXd parameters{};
  CameraModel camera;
};

/// Where a camera stood for one of the pictures.
using PoseStart = std::function<RoughPose(std::size_t picture, const NumberedCamera& camera)>;

/// From the tags of a picture, of which some may be wrong; `pictures` and `target` outlive the result.
[[nodiscard]] PoseStart start_from_tags(const std::vector<std::vector<TagDetection>>& pictures,
                                        const TagMap& target);
/// From all points of a picture of a flat target (z = 0), by their homography (Zhang, section 3.1); of its
/// pose and the one reflected at the line of sight the better. `views` outlive the result.
[[nodiscard]] PoseStart start_from_plane(const std::vector<TargetView>& views);

/// The problem and where the search stands.
struct Search {
  PoseStart start{};
  FitOptions fit{};
  Eigen::VectorXd parameters{};
  std::vector<TargetView> views{};
};

/// Whether a picture shows enough of the target: eight numbers or more than its pose has, not on one line.
[[nodiscard]] bool usable(const TargetView& view);

/// Starts anew for this lens: a focal length from a row of them, and where the camera stood for each picture.
/// Views that no camera explains lose their marks.
[[nodiscard]] Status begin_search(Search& search, LensModel lens);

/// Where a picture is explained better from another place (a flat target seen from afar has two poses that
/// look alike), the view goes there.
void find_better_poses(Search& search, const NumberedCamera& camera);

/// Squared distances of a view's used corners from where they project [px^2].
[[nodiscard]] std::vector<double> squared_distances_px2(const TargetView& view, const CameraModel& camera);
[[nodiscard]] double root_mean(const std::vector<double>& squares);

[[nodiscard]] CalibratedView summary_of(const TargetView& view, const CameraModel& camera);
[[nodiscard]] std::array<ImageRegion, 9> regions_of(const std::vector<TargetView>& views,
                                                    const CameraModel& camera);

}  // namespace waymark::internal
