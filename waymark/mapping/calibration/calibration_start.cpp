#include <algorithm>
#include <cmath>
#include <limits>

#include "waymark/mapping/calibration/calibration_search.hpp"
#include "waymark/pose/multi_tag_pose.hpp"

namespace waymark::internal {
namespace {

/// Where a camera without distortion must stand to see a picture, whatever its corners' noise; how badly it
/// fits [px].
struct RoughPose {
  SE3 target_T_cam{};
  double rms_px = std::numeric_limits<double>::infinity();
};

RoughPose rough_pose(const std::vector<TagDetection>& detections, const TagMap& target,
                     const CameraModel& camera) {
  constexpr double kNoGate = 1e9;
  constexpr double kRoughPx = 2;
  std::vector<TagDetection> rough;
  for (TagDetection detection : detections) {
    detection.corner_covariance_px2.reset();
    if (target.find(detection.tag) != nullptr) rough.push_back(std::move(detection));
  }
  const auto pose = estimate_camera_pose(
      rough, target, camera,
      {.corner_sigma_px = kRoughPx, .tag_gate_chi2 = kNoGate, .corner_gate_chi2 = kNoGate});
  if (!pose || pose->estimates.empty()) return {};
  const CameraPoseEstimate& best = pose->estimates.front();
  return {best.map_T_cam, best.rms_px};
}

Eigen::VectorXd rough_parameters(LensModel lens, double focal_px, int width_px, int height_px) {
  Eigen::VectorXd p = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameter_names(lens).size()));
  p.head<4>() << focal_px, focal_px, 0.5 * width_px, 0.5 * height_px;
  return p;
}

/// The focal length under which an undistorted camera explains a few pictures best, of a row of them from
/// telephoto to fisheye.
double rough_focal_px(const Search& search, LensModel lens) {
  constexpr std::size_t kPicturesTried = 8;
  constexpr double kShortest = 0.2;
  constexpr double kLongest = 6;
  constexpr double kRatio = 1.15;
  const LensModel straight = lens == LensModel::Equidistant ? lens : LensModel::None;
  double best_px = 0;
  double best_cost = std::numeric_limits<double>::infinity();
  for (double share = kShortest; share < kLongest; share *= kRatio) {
    const double focal_px = share * search.fit.width_px;
    const auto camera =
        camera_of(straight, rough_parameters(straight, focal_px, search.fit.width_px, search.fit.height_px),
                  search.fit.width_px, search.fit.height_px);
    if (!camera) continue;
    double cost = 0;
    std::size_t tried = 0;
    for (std::size_t i = 0; i < search.views.size() && tried < kPicturesTried; ++i) {
      if (!usable(search.views[i])) continue;
      const double rms_px = rough_pose(search.pictures[i], search.target, *camera).rms_px;
      cost += std::min(rms_px * rms_px, 1e4);
      ++tried;
    }
    if (cost < best_cost) {
      best_cost = cost;
      best_px = focal_px;
    }
  }
  return best_px;
}

}  // namespace

bool usable(const TargetView& view) {
  constexpr std::size_t kFewestTags = 2;
  return std::ranges::count_if(view.tags, &TargetTag::used) >= static_cast<std::ptrdiff_t>(kFewestTags);
}

Status begin_search(Search& search, LensModel lens) {
  search.fit.lens = lens;
  const LensModel straight = lens == LensModel::Equidistant ? lens : LensModel::None;
  const double focal_px = rough_focal_px(search, lens);
  search.parameters = rough_parameters(lens, focal_px, search.fit.width_px, search.fit.height_px);
  const auto camera =
      camera_of(straight, rough_parameters(straight, focal_px, search.fit.width_px, search.fit.height_px),
                search.fit.width_px, search.fit.height_px);
  if (!camera) return tl::unexpected(camera.error());
  for (std::size_t i = 0; i < search.views.size(); ++i) {
    if (!usable(search.views[i])) continue;
    const RoughPose rough = rough_pose(search.pictures[i], search.target, *camera);
    if (std::isfinite(rough.rms_px)) {
      search.views[i].target_T_cam = rough.target_T_cam;
    } else {
      search.views[i].tags.clear();
    }
  }
  return {};
}

void find_better_poses(Search& search, const CameraModel& camera) {
  const auto cost = [&](const TargetView& view) {
    double sum = 0;
    for (const TargetTag& tag : view.tags)
      if (tag.used) sum += tag_chi2(tag, view, camera).value_or(std::numeric_limits<double>::infinity());
    return sum;
  };
  for (std::size_t i = 0; i < search.views.size(); ++i) {
    if (!usable(search.views[i])) continue;
    TargetView elsewhere = search.views[i];
    elsewhere.target_T_cam = rough_pose(search.pictures[i], search.target, camera).target_T_cam;
    if (cost(elsewhere) < cost(search.views[i])) search.views[i] = elsewhere;
  }
}

}  // namespace waymark::internal
