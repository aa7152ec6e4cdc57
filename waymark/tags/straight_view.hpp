#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/image/image.hpp"

namespace waymark {

/// Maximum distance [px] between a straight edge in the world and the chord between its two image points,
/// over the four sides of a quad. It is 0 without distortion. Returns `nullopt` if a corner is outside the
/// domain of the camera model.
[[nodiscard]] std::optional<double> edge_bulge_px(const CameraModel& camera,
                                                  const std::array<Eigen::Vector2d, 4>& corners_px);

/// A perspective view of one tag without distortion, resampled from the image of a camera with distortion.
/// Straight edges in the world are straight in this view, so the detector and the corner refinement work
/// there as for a camera without distortion. The view is a camera with the same centre that is turned towards
/// the tag. The resolution at its centre is that of the image. Cameras with a common centre differ only by a
/// homography (Hartley and Zisserman, "Multiple View Geometry", section 8.4.2).
class StraightView {
 public:
  /// A view of the quad and of a margin around it. Returns `nullopt` if the quad is not inside the image and
  /// the domain of the camera model, or if the view would be larger than kMaxSide_px. O(pixels of the view).
  [[nodiscard]] static std::optional<StraightView> around(const ImageView& image, const CameraModel& camera,
                                                          const std::array<Eigen::Vector2d, 4>& corners_px);

  static constexpr int kMaxSide_px = 2000;

  [[nodiscard]] const Image& image() const { return image_; }

  /// The point of the view that shows the same ray as a pixel of the camera.
  [[nodiscard]] std::optional<Eigen::Vector2d> from_camera(const Eigen::Vector2d& camera_px) const;
  /// The pixel of the camera that shows the same ray as a point of the view. If J is not null, it receives
  /// the derivative of the pixel with respect to the point.
  [[nodiscard]] std::optional<Eigen::Vector2d> to_camera(const Eigen::Vector2d& view_px,
                                                         Eigen::Matrix2d* J = nullptr) const;

 private:
  StraightView(const CameraModel& camera, const SO3& cam_R_view, double focal_px)
      : camera_(camera), cam_R_view_(cam_R_view), focal_px_(focal_px) {}

  void resample(const ImageView& image, const Eigen::Vector2i& size_px);

  CameraModel camera_;
  SO3 cam_R_view_;
  double focal_px_ = 0;
  Eigen::Vector2d principal_px_ = Eigen::Vector2d::Zero();
  Image image_;
};

}  // namespace waymark
