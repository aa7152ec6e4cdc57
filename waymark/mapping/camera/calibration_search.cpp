#include "waymark/mapping/camera/calibration_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "waymark/base/angles.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/mapping/solver/image_region.hpp"
#include "waymark/pose/homography.hpp"
#include "waymark/pose/multi_tag_pose.hpp"

namespace waymark::internal {
namespace {

Eigen::VectorXd rough_parameters(LensModel lens, double focal_px, int width_px, int height_px) {
  Eigen::VectorXd p = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameter_names(lens).size()));
  p.head<4>() << focal_px, focal_px, 0.5 * width_px, 0.5 * height_px;
  return p;
}

Result<ParametricCamera> straight_camera(LensModel lens, double focal_px, const FitOptions& fit) {
  const Eigen::VectorXd parameters = rough_parameters(lens, focal_px, fit.width_px, fit.height_px);
  auto camera = camera_of(lens, parameters, fit.width_px, fit.height_px);
  if (!camera) return tl::unexpected(camera.error());
  return ParametricCamera{.lens = lens, .parameters = parameters, .camera = *std::move(camera)};
}

/// The focal length with which an undistorted camera fits a few images best, selected from a geometric series
/// that ranges from telephoto to fisheye.
double rough_focal_px(const Search& search, LensModel lens) {
  constexpr std::size_t kMaxImagesTried = 8;
  constexpr double kMinFocalShare = 0.2;
  constexpr double kMaxFocalShare = 6;
  constexpr double kRatio = 1.15;
  const LensModel straight = lens == LensModel::Equidistant ? lens : LensModel::None;
  double best_px = 0;
  double best_cost = std::numeric_limits<double>::infinity();
  for (double share = kMinFocalShare; share < kMaxFocalShare; share *= kRatio) {
    const double focal_px = share * search.fit.width_px;
    const auto camera = straight_camera(straight, focal_px, search.fit);
    if (!camera) continue;
    double cost = 0;
    std::size_t tried = 0;
    for (std::size_t i = 0; i < search.views.size() && tried < kMaxImagesTried; ++i) {
      if (!usable(search.views[i])) continue;
      const double rms_px = search.start(i, *camera).rms_px;
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

/// The pose that corresponds to a homography from the target's plane to the plane z = 1.
SE3 pose_of(const Eigen::Matrix3d& cam_H_target) {
  const double scale = 2 / (cam_H_target.col(0).norm() + cam_H_target.col(1).norm());
  const Eigen::Matrix3d H = scale * cam_H_target;
  Eigen::Matrix3d R;
  R << H.col(0), H.col(1), H.col(0).cross(H.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  R = svd.matrixU() * svd.matrixV().transpose();
  return {SO3::from_matrix(R), H.col(2)};
}

/// The other pose of a flat target with nearly the same image, in which its normal is mirrored about the line
/// of sight (Schweighofer and Pinz, "Robust Pose Estimation from a Planar Target", 2006).
SE3 reflected(const SE3& cam_T_target) {
  const Eigen::Vector3d sight = cam_T_target.translation().normalized();
  const Eigen::Vector3d normal = cam_T_target.rotation() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d other = 2 * normal.dot(sight) * sight - normal;
  const Eigen::Quaterniond turn = rotation_between(normal, other);
  const Eigen::AngleAxisd axis(turn);
  return {SO3::exp(axis.angle() * axis.axis()) * cam_T_target.rotation(), cam_T_target.translation()};
}

/// The pose of the view, refined from the given pose; the error is infinite if the search fails.
RoughPose refined(TargetView view, const SE3& cam_T_target, const ParametricCamera& camera) {
  view.target_T_cam = cam_T_target.inverse();
  std::vector<TargetView> one{std::move(view)};
  const FitOptions poses{.lens = camera.lens,
                         .width_px = camera.camera.width_px(),
                         .height_px = camera.camera.height_px(),
                         .free_parameters = 0,
                         .max_iterations = 15};
  if (!fit_intrinsics(one, camera.parameters, poses)) return {};
  return {one.front().target_T_cam, root_mean(squared_distances_px2(one.front(), camera.camera))};
}

RoughPose rough_pose(const TargetView& view, const ParametricCamera& camera) {
  std::vector<Eigen::Vector2d> places;
  std::vector<Eigen::Vector2d> normalised;
  for (const ViewMark& mark : view.marks) {
    for (std::size_t i = 0; mark.used && i < mark.seen.seen_px.size(); ++i) {
      const auto sight = camera.camera.normalize(mark.seen.seen_px[i]);
      if (!sight) continue;
      places.emplace_back(mark.seen.target_points_m[i].head<2>());
      normalised.push_back(*sight);
    }
  }
  const auto homography = homography_dlt(places, normalised);
  if (!homography) return {};
  const SE3 first = pose_of(*homography);
  const RoughPose found = refined(view, first, camera);
  const RoughPose other = refined(view, reflected(first), camera);
  return other.rms_px < found.rms_px ? other : found;
}

/// The pose estimated from tags, regardless of the noise in their corners.
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

}  // namespace

PoseStart start_from_tags(const std::vector<std::vector<TagDetection>>& images, const TagMap& target) {
  return [&](std::size_t image, const ParametricCamera& camera) {
    return rough_pose(images[image], target, camera.camera);
  };
}

PoseStart start_from_plane(const std::vector<TargetView>& views) {
  return [&](std::size_t image, const ParametricCamera& camera) { return rough_pose(views[image], camera); };
}

bool usable(const TargetView& view) {
  constexpr int kMinPoints = 8;
  constexpr double kMinWidthShare = 0.02;  // a narrower strip is treated as a line
  int points = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (const ViewMark& mark : view.marks) {
    for (std::size_t i = 0; mark.used && i < mark.seen.target_points_m.size(); ++i) {
      const Eigen::Vector3d& point = mark.seen.target_points_m[i];
      sum += point;
      squares += point * point.transpose();
      ++points;
    }
  }
  if (points < kMinPoints) return false;
  const Eigen::Vector3d mean = sum / points;
  const Eigen::Vector3d spread_m2 = symmetric_eigen<3>(squares / points - mean * mean.transpose()).values;
  return spread_m2[1] > kMinWidthShare * kMinWidthShare * spread_m2[2];
}

Status begin_search(Search& search, LensModel lens) {
  search.fit.lens = lens;
  const LensModel straight = lens == LensModel::Equidistant ? lens : LensModel::None;
  const double focal_px = rough_focal_px(search, lens);
  search.parameters = rough_parameters(lens, focal_px, search.fit.width_px, search.fit.height_px);
  const auto camera = straight_camera(straight, focal_px, search.fit);
  if (!camera) return tl::unexpected(camera.error());
  for (std::size_t i = 0; i < search.views.size(); ++i) {
    if (!usable(search.views[i])) continue;
    const RoughPose rough = search.start(i, *camera);
    if (std::isfinite(rough.rms_px)) {
      search.views[i].target_T_cam = rough.target_T_cam;
    } else {
      search.views[i].marks.clear();
    }
  }
  return {};
}

void find_better_poses(Search& search, const ParametricCamera& camera) {
  const auto cost = [&](const TargetView& view) {
    double sum = 0;
    for (const ViewMark& mark : view.marks)
      if (mark.used)
        sum += mark_chi2(mark, view, camera.camera).value_or(std::numeric_limits<double>::infinity());
    return sum;
  };
  for (std::size_t i = 0; i < search.views.size(); ++i) {
    if (!usable(search.views[i])) continue;
    TargetView elsewhere = search.views[i];
    elsewhere.target_T_cam = search.start(i, camera).target_T_cam;
    if (cost(elsewhere) < cost(search.views[i])) search.views[i] = elsewhere;
  }
}

namespace {

/// Calls `each` with the observed and the projected position of each corner in use.
template <class Each>
void for_each_corner(const TargetView& view, const CameraModel& camera, const Each& each) {
  const SE3 cam_T_target = view.target_T_cam.inverse();
  for (const ViewMark& mark : view.marks)
    for (std::size_t i = 0; mark.used && i < mark.seen.seen_px.size(); ++i)
      if (const auto px = camera.project(cam_T_target * mark.seen.target_points_m[i]))
        each(mark.seen.seen_px[i], *px);
}

}  // namespace

std::vector<double> squared_distances_px2(const TargetView& view, const CameraModel& camera) {
  std::vector<double> squares;
  for_each_corner(view, camera, [&](const Eigen::Vector2d& seen, const Eigen::Vector2d& px) {
    squares.push_back((px - seen).squaredNorm());
  });
  return squares;
}

double root_mean(const std::vector<double>& squares) {
  double sum = 0;
  for (const double value : squares) sum += value;
  return squares.empty() ? 0 : std::sqrt(sum / static_cast<double>(squares.size()));
}

CalibratedView summary_of(const TargetView& view, const CameraModel& camera) {
  CalibratedView summary;
  summary.marks = static_cast<std::size_t>(std::ranges::count_if(view.marks, &ViewMark::used));
  summary.rejected = view.marks.size() - summary.marks;
  if (summary.marks == 0) return summary;
  summary.rms_px = root_mean(squared_distances_px2(view, camera));
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double points = 0;
  for (const ViewMark& mark : view.marks) {
    if (!mark.used) continue;
    for (const Eigen::Vector3d& point : mark.seen.target_points_m) {
      middle += point;
      ++points;
    }
  }
  for (const ViewMark& mark : view.marks) summary.used.push_back(mark.used);
  summary.target_T_cam = view.target_T_cam;
  const SE3 cam_T_target = view.target_T_cam.inverse();
  const Eigen::Vector3d normal = cam_T_target.rotation() * Eigen::Vector3d::UnitZ();
  summary.distance_m = (cam_T_target * Eigen::Vector3d(middle / points)).norm();
  summary.tilt_deg = to_degrees(std::acos(std::clamp(normal.z(), -1.0, 1.0)));
  return summary;
}

std::array<ImageRegion, 9> regions_of(const std::vector<TargetView>& views, const CameraModel& camera) {
  std::array<std::vector<double>, 9> squares;
  std::array<std::vector<double>, 9> chi2;  // for each coordinate
  for (const TargetView& view : views) {
    for_each_corner(view, camera, [&](const Eigen::Vector2d& seen, const Eigen::Vector2d& px) {
      squares.at(internal::ninth_of(seen, camera)).push_back((px - seen).squaredNorm());
    });
    for (const ViewMark& mark : view.marks) {
      const auto of_mark = mark.used ? mark_chi2(mark, view, camera) : std::nullopt;
      for (std::size_t i = 0; of_mark && i < mark.seen.seen_px.size(); ++i)
        chi2.at(internal::ninth_of(mark.seen.seen_px[i], camera))
            .push_back(*of_mark / static_cast<double>(mark.numbers()));
    }
  }
  std::array<ImageRegion, 9> regions;
  for (std::size_t i = 0; i < regions.size(); ++i)
    regions[i] = {squares[i].size(), root_mean(squares[i]), root_mean(chi2[i])};
  return regions;
}

}  // namespace waymark::internal
