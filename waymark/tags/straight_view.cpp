#include "waymark/tags/straight_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Quad = std::array<Vector2d, 4>;

std::optional<std::array<Vector3d, 4>> bearings_of(const CameraModel& camera, const Quad& corners_px) {
  std::array<Vector3d, 4> bearings;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto bearing = camera.unproject(corners_px[k]);
    if (!bearing) return std::nullopt;
    bearings[k] = *bearing;
  }
  return bearings;
}

/// The rotation that turns the optical axis of the view to the middle of the bearings, by the smallest angle.
SO3 turn_to(const std::array<Vector3d, 4>& bearings) {
  const Vector3d middle = bearings[0] + bearings[1] + bearings[2] + bearings[3];
  return SO3::from_quaternion(Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), middle));
}

}  // namespace

std::optional<double> edge_bulge_px(const CameraModel& camera, const Quad& corners_px) {
  const auto bearings = bearings_of(camera, corners_px);
  if (!bearings) return std::nullopt;
  double bulge_px = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t next = (k + 1) % 4;
    const Vector2d chord = corners_px[next] - corners_px[k];
    const auto middle = camera.project((*bearings)[k] + (*bearings)[next]);
    if (!middle || chord.norm() == 0) return std::nullopt;
    const Vector2d off = *middle - corners_px[k];
    bulge_px = std::max(bulge_px, std::abs(chord.x() * off.y() - chord.y() * off.x()) / chord.norm());
  }
  return bulge_px;
}

std::optional<Vector2d> StraightView::from_camera(const Vector2d& camera_px) const {
  constexpr double kMinCosine = 0.1;  // at the edge of a view of nearly 180 degrees
  const auto bearing = camera_.unproject(camera_px);
  if (!bearing) return std::nullopt;
  const Vector3d view_p = cam_R_view_.inverse() * *bearing;
  if (view_p.z() < kMinCosine) return std::nullopt;
  return Vector2d(focal_px_ * view_p.head<2>() / view_p.z() + principal_px_);
}

std::optional<Vector2d> StraightView::to_camera(const Vector2d& view_px, Eigen::Matrix2d* J) const {
  const Vector2d at = (view_px - principal_px_) / focal_px_;
  const Vector3d cam_p = cam_R_view_ * Vector3d(at.x(), at.y(), 1);
  Matrix23 J_px_p;
  const auto px = camera_.project(cam_p, J == nullptr ? nullptr : &J_px_p);
  if (px && J != nullptr) *J = J_px_p * cam_R_view_.matrix().leftCols<2>() / focal_px_;
  return px;
}

std::optional<StraightView> StraightView::around(const ImageView& image, const CameraModel& camera,
                                                 const Quad& corners_px) {
  constexpr double kMargin = 0.4;  // of the longest side: the white margin and the search for edges
  constexpr double kMargin_px = 8;
  const auto bearings = bearings_of(camera, corners_px);
  const bool inside = std::ranges::all_of(corners_px, [&](const Vector2d& px) {
    return px.x() >= 0 && px.y() >= 0 && px.x() <= image.width && px.y() <= image.height;
  });
  if (!bearings || !inside) return std::nullopt;

  StraightView view(camera, turn_to(*bearings), 1);
  Eigen::Matrix2d J;
  if (!view.to_camera(Vector2d::Zero(), &J)) return std::nullopt;
  view.focal_px_ = std::sqrt(std::abs(J.determinant()));  // the same area of a pixel at the centre
  if (!(view.focal_px_ > 1)) return std::nullopt;

  Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity());
  Vector2d high = -low;
  for (const Vector2d& corner : corners_px) {
    const auto px = view.from_camera(corner);
    if (!px) return std::nullopt;
    low = low.cwiseMin(*px);
    high = high.cwiseMax(*px);
  }
  const double margin_px = kMargin * (high - low).maxCoeff() + kMargin_px;
  const Vector2d size_px = (high - low).array() + 2 * margin_px;
  if (!(size_px.maxCoeff() < kMaxSide_px)) return std::nullopt;
  view.principal_px_ = margin_px - low.array();
  view.resample(image, size_px.array().ceil().cast<int>());
  return view;
}

/// The mapping is smooth, so it is computed at the nodes of a grid and interpolated. An edge that bulges by
/// 10 px over 100 px deviates from chords of 4 px by 0.02 px.
void StraightView::resample(const ImageView& image, const Eigen::Vector2i& size_px) {
  constexpr int kStep = 4;
  constexpr std::uint8_t kOutside = 128;
  image_ = Image(size_px.x(), size_px.y(), kOutside);
  const int columns = size_px.x() / kStep + 2;
  std::vector<Vector2d> above(static_cast<std::size_t>(columns));
  std::vector<Vector2d> below(above.size());
  const auto fill = [&](std::vector<Vector2d>& nodes, int y) {
    for (int i = 0; i < columns; ++i)
      nodes[static_cast<std::size_t>(i)] =
          to_camera(Vector2d(kStep * i + 0.5, y + 0.5))
              .value_or(Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
  };
  fill(below, 0);
  for (int y = 0; y < size_px.y(); ++y) {
    const int row = y % kStep;
    if (row == 0) {
      std::swap(above, below);
      fill(below, y + kStep);
    }
    const double down = static_cast<double>(row) / kStep;
    std::uint8_t* out = image_.row(y);
    for (int x = 0; x < size_px.x(); ++x) {
      const auto node = static_cast<std::size_t>(x / kStep);
      const double along = static_cast<double>(x % kStep) / kStep;
      const Vector2d left = (1 - down) * above[node] + down * below[node];
      const Vector2d right = (1 - down) * above[node + 1] + down * below[node + 1];
      const Vector2d px = (1 - along) * left + along * right;
      if (px.allFinite())
        out[x] = static_cast<std::uint8_t>(std::lround(sample_bilinear(image, px.x(), px.y())));
    }
  }
}

}  // namespace waymark
