#include "waymark/mapping/camera/mark_projection.hpp"
#include "waymark/geometry/dense.hpp"

#include <algorithm>
#include <utility>

#include <Eigen/Cholesky>

namespace waymark::internal {
namespace {

MarkVector seen_of(const ViewMark& mark) {
  MarkVector px(mark.numbers());
  for (Eigen::Index i = 0; 2 * i < px.size(); ++i)
    px.segment<2>(2 * i) = mark.seen.seen_px[static_cast<std::size_t>(i)];
  return px;
}

}  // namespace

std::array<Eigen::Vector3d, 4> camera_points(const ViewMark& mark, const SE3& cam_T_target) {
  std::array<Eigen::Vector3d, 4> points{};
  for (std::size_t i = 0; i < mark.seen.target_points_m.size(); ++i)
    points.at(i) = cam_T_target * mark.seen.target_points_m[i];
  return points;
}

std::optional<MarkVector> projected(const ViewMark& mark, const std::array<Eigen::Vector3d, 4>& cam_points,
                                    const CameraModel& camera) {
  MarkVector px(mark.numbers());
  for (Eigen::Index i = 0; 2 * i < px.size(); ++i) {
    const auto one = camera.project(cam_points.at(static_cast<std::size_t>(i)));
    if (!one) return std::nullopt;
    px.segment<2>(2 * i) = *one;
  }
  return px;
}

Result<ViewMark> view_mark(TargetMark mark, double corner_sigma_px) {
  ViewMark view{.seen = std::move(mark)};
  const Eigen::Index n = view.numbers();
  const TargetMark& seen = view.seen;
  const auto finite = [](const auto& point) { return point.allFinite(); };
  if (n < 2 || n > 8 || seen.seen_px.size() != seen.target_points_m.size() ||
      !std::ranges::all_of(seen.seen_px, finite) || !std::ranges::all_of(seen.target_points_m, finite))
    return fail(ErrorCode::InvalidArgument, "the corners of a mark are not finite");
  if (seen.covariance_px2.size() == 0) {
    view.whitening = MarkMatrix::Identity(n, n) / corner_sigma_px;
    return view;
  }
  const auto refused = [] {
    return fail(ErrorCode::InvalidArgument, "the covariance of a mark's corners is not positive definite");
  };
  if (seen.covariance_px2.rows() != n || seen.covariance_px2.cols() != n || !seen.covariance_px2.allFinite())
    return refused();
  const Cholesky factor(seen.covariance_px2);
  if (!factor.positive()) return refused();
  view.whitening = factor.whitening();
  return view;
}

std::optional<double> mark_chi2(const ViewMark& mark, const TargetView& view, const CameraModel& camera) {
  const auto px = projected(mark, camera_points(mark, view.target_T_cam.inverse()), camera);
  if (!px) return std::nullopt;
  return MarkVector(mark.whitening * (*px - seen_of(mark))).squaredNorm();
}

}  // namespace waymark::internal
