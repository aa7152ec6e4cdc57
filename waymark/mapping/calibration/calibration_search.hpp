#pragma once

#include <array>
#include <vector>

#include "waymark/mapping/calibration/camera_calibration.hpp"
#include "waymark/mapping/calibration/intrinsics_fit.hpp"

/// The parts of calibrate_camera(): where the search begins, and how its end is judged.
namespace waymark::internal {

/// The problem and where the search stands.
struct Search {
  const std::vector<std::vector<TagDetection>>& pictures;
  const TagMap& target;
  FitOptions fit{};
  Eigen::VectorXd parameters{};
  std::vector<TargetView> views{};
};

/// Whether a picture shows enough of the target.
[[nodiscard]] bool usable(const TargetView& view);

/// Starts anew for this lens: a focal length from a row of them, and where the camera stood for each picture.
/// Views that no camera explains lose their tags.
[[nodiscard]] Status begin_search(Search& search, LensModel lens);

/// Where a picture is explained better from another place (a flat target seen from afar has two poses that
/// look alike), the view goes there.
void find_better_poses(Search& search, const CameraModel& camera);

/// Squared distances of a view's used corners from where they project [px^2].
[[nodiscard]] std::vector<double> squared_distances_px2(const TargetView& view, const CameraModel& camera);
[[nodiscard]] double root_mean(const std::vector<double>& squares);

[[nodiscard]] CalibratedView summary_of(const TargetView& view, const CameraModel& camera);
[[nodiscard]] std::array<ImageRegion, 9> regions_of(const std::vector<TargetView>& views,
                                                    const CameraModel& camera);

}  // namespace waymark::internal
