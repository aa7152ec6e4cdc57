#pragma once

#include <array>
#include <optional>
#include <variant>

#include <Eigen/Core>

#include "waymark/base/error.hpp"

namespace waymark {

/// J_px_p: derivative of the projected pixel with respect to the point in the camera frame.
using Matrix23 = Eigen::Matrix<double, 2, 3>;

/// A pinhole camera with radial-tangential distortion (Brown, "Decentering distortion of lenses", 1966;
/// OpenCV, "Camera Calibration and 3D Reconstruction"). The coefficients are in OpenCV's order k1 k2 p1 p2
/// [k3 [k4 k5 k6]]; k4 k5 k6 select the rational model. The parameters fx, fy, cx, cy are in pixels, with
/// pixel centres at +1/2.
struct PinholeRadtan {
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::array<double, 8> k{};  ///< k1 k2 p1 p2 k3 k4 k5 k6; zero beyond `coefficients`
  int coefficients = 0;       ///< number in use: 0, 4, 5 or 8 (stored so that files are rewritten unchanged)
  double skew = 0;            ///< [px] the x coordinate of a pixel is fx x + skew y + cx; usually 0

  friend bool operator==(const PinholeRadtan&, const PinholeRadtan&) = default;
};

/// An equidistant fisheye (Kannala and Brandt, "A generic camera model and calibration method for
/// conventional, wide-angle, and fish-eye lenses", PAMI 2006): theta_d = theta (1 + k1 theta^2 + k2 theta^4 +
/// k3 theta^6 + k4 theta^8). It can project points that are more than 90 degrees off its axis. Pixel centres
/// are at +1/2.
struct Equidistant {
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::array<double, 4> k{};
  double skew = 0;  ///< as in PinholeRadtan; estimated by the fisheye calibrator of ROS

  friend bool operator==(const Equidistant&, const Equidistant&) = default;
};

/// A camera: a projection and an image size. Immutable and validated: only make() creates cameras, so all
/// methods may assume positive focal lengths and a valid domain. Outside the domain, methods return
/// `nullopt`.
class CameraModel {
 public:
  using Projection = std::variant<PinholeRadtan, Equidistant>;

  /// Determines the domain: the largest cone about the optical axis in which the projection is one-to-one
  /// (see Radtan::domain and EquidistantAngle::domain). Fails if a parameter is not finite, or if a focal
  /// length or size is <= 0 or larger than for any real lens. Fails if a coefficient beyond their count is
  /// not zero. Also fails if the distortion folds before the nearest image edge and the domain covers less
  /// than 30 % of the image. The image circle of a fisheye may end inside the image, so for a fisheye this is
  /// an error only if the distortion also folds before 90 degrees. The location of the error names the field.
  static Result<CameraModel> make(const Projection& projection, int width_px, int height_px);

  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }
  [[nodiscard]] const Projection& projection() const { return projection_; }

  /// Half the opening angle of the domain: a point at or beyond this angle from the optical axis does not
  /// project. It is 90 degrees without distortion, and at most 180 degrees (equidistant). The image may cover
  /// only part of the cone, and its corners may lie outside the cone.
  [[nodiscard]] double max_angle_rad() const;
  /// Whether the domain reaches the nearest edge of the image. Always true for a fisheye with a domain of at
  /// least 90 degrees, whose image circle may end inside the image. A good calibration of a pinhole lens has
  /// this property, so the calibrations of this project estimate no other lens.
  [[nodiscard]] bool reaches_an_edge() const;

  /// Pixel of a point in the camera frame (x right, y down, z forward) [m]; pixel centres are at +1/2.
  /// Returns `nullopt` if the point is outside the domain (behind the camera or beyond the fold of the
  /// distortion) or not a number. The pixel may lie outside the image: see contains(). If J_px_p is not null,
  /// it receives the 2x3 Jacobian [px/m], unless the result is empty.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& cam_p,
                                                       Matrix23* J_px_p = nullptr) const;

  /// Unit bearing of a pixel in the camera frame; `nullopt` if no point in the domain projects there. The
  /// result always projects again, to within 1e-9 px of the original for pixels within 10000 px, and to
  /// within 1e-13 (relative) beyond that.
  [[nodiscard]] std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& px) const;

  /// Normalised image coordinates (x/z, y/z) without distortion; `nullopt` if unproject() returns `nullopt`
  /// or z <= 0.
  [[nodiscard]] std::optional<Eigen::Vector2d> normalize(const Eigen::Vector2d& px) const;

  /// Whether a point in the domain projects to each of these pixels.
  template <class Pixels>
  [[nodiscard]] bool covers(const Pixels& pixels) const {
    for (const Eigen::Vector2d& px : pixels)
      if (!unproject(px)) return false;
    return true;
  }

  /// Whether the pixel lies in the image.
  [[nodiscard]] bool contains(const Eigen::Vector2d& px) const;

  friend bool operator==(const CameraModel&, const CameraModel&) = default;

 private:
  CameraModel(const Projection& projection, int width_px, int height_px, double limit)
      : projection_(projection), width_px_(width_px), height_px_(height_px), limit_(limit) {}

  Projection projection_;
  int width_px_ = 0;
  int height_px_ = 0;
  double limit_ = 0;  ///< largest undistorted radius (radtan, x/z) or angle (equidistant, rad) of the domain
};

/// Fails if an image of this size cannot be from this camera, because intrinsics are valid for only one
/// resolution.
[[nodiscard]] Status check_camera_matches_image(const CameraModel& camera, int width_px, int height_px);

/// The same camera with its images scaled to another size, as by a sensor with binning; pixel centres are at
/// +1/2 in both. Fails if the aspect ratios differ (by more than 1 %), as for a cropped image.
[[nodiscard]] Result<CameraModel> scaled_camera(const CameraModel& camera, int width_px, int height_px);

}  // namespace waymark
