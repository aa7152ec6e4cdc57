#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

namespace waymark::refinement {

/// Displacement of the print on a tag due to lens distortion, relative to the homography given by its four
/// corners. It is of fourth order in s and t (along TL-TR and TR-BR, from -1 to 1) and 0 at the corners.
struct LensField {
  static constexpr std::size_t kNodes = 5;  ///< at -1, -1/2, 0, 1/2 and 1
  /// displacements at the nodes of s for the first node of t, then for the second, …
  std::array<Eigen::Vector2d, kNodes * kNodes> off_px{};

  [[nodiscard]] Eigen::Vector2d at(double s, double t) const;
};

/// The field for the tag between these edges; `nullopt` outside the domain of the camera model.
[[nodiscard]] std::optional<LensField> lens_field(const CameraModel& camera,
                                                  const std::array<EdgeFrame, 4>& edges);

/// Computes the expected curvature of edges in the image. With a camera model, the bulge of a straight line
/// is computed and written to EdgeFrame::bulge_px; without one (or outside its domain), the bulge is 0.
/// Returns the standard deviation of the additional curvature that the fit may estimate [px]. It is a tenth
/// of the camera model's bulge, or the sagitta that `curvature_per_px` causes over the length of the edge.
std::array<double, 4> expect_bends(const CameraModel* camera, double curvature_per_px,
                                   std::array<EdgeFrame, 4>& edges);

/// Displacement of the print by an unknown radial distortion, relative to the homography given by the
/// corners. Let u be the position relative to the middle of the tag, in sides of the tag. The displacement is
/// u.u (g + k u), minus the infinitesimal homography that moves the corners by the same amount. To third
/// order in u, this is the displacement by k1 r^2 without what a homography contains. The vector g points
/// towards the optical axis or away from it.
struct RadialField {
  Eigen::Vector2d middle_px{0, 0};
  double side_px = 1;
  Eigen::Vector3d radial_px{0, 0, 0};                                               ///< g and k
  Eigen::Matrix<double, 8, 1> homography_px = Eigen::Matrix<double, 8, 1>::Zero();  ///< see at()

  /// The displacement [px] at a pixel `u` from the middle, in sides. T is an array of numbers.
  template <class T, class Scalar = typename T::Scalar>
  [[nodiscard]] std::array<T, 2> at(const T& x, const T& y) const {
    const auto radial = [this](int i) { return static_cast<Scalar>(radial_px[i]); };
    const auto plane = [this](int i) { return static_cast<Scalar>(homography_px[i]); };
    const T square = x * x + y * y;
    const T tilt = plane(6) * x + plane(7) * y;
    return {T(square * (radial(0) + radial(2) * x) - (plane(0) + plane(2) * x + plane(3) * y + tilt * x)),
            T(square * (radial(1) + radial(2) * y) - (plane(1) + plane(4) * x + plane(5) * y + tilt * y))};
  }
};

/// The field whose bulges at the middles of the edges fit `bend_px` (outwards, by least squares).
[[nodiscard]] RadialField radial_field(const std::array<EdgeFrame, 4>& edges,
                                       const std::array<double, 4>& bend_px);
/// The outward bulge of an edge by the field [px].
[[nodiscard]] double bulge_px(const RadialField& field, const EdgeFrame& edge);

}  // namespace waymark::refinement
