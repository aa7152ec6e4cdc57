#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"

namespace waymark::refinement {

using Quad = std::array<Eigen::Vector2d, 4>;

/// What moves the pixels around a tag so that straight lines of the world are straight: the distortion of a
/// camera model, as a polynomial of third degree in x and y over the neighbourhood of the tag, less its
/// linear part in the tag's middle. Without a camera: nothing moves.
class Straightening {
 public:
  Straightening() = default;

  /// Nothing where the model does not reach. O(1), 20 pixels are normalised.
  [[nodiscard]] static std::optional<Straightening> of(const CameraModel& camera, const Quad& corners_px);

  /// One row of pixels: cubic in x.
  struct Row {
    std::array<Eigen::Vector2d, 4> by_x{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(),
                                        Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
    [[nodiscard]] Eigen::Vector2d at(double x) const {
      return by_x[0] + x * (by_x[1] + x * (by_x[2] + x * by_x[3]));
    }
  };
  [[nodiscard]] bool moves() const { return moves_; }
  [[nodiscard]] Row row(double y_px) const;
  /// Place along a row in the units of Row.
  [[nodiscard]] double along(double x_px) const { return (x_px - middle_px_.x()) / reach_px_; }

  [[nodiscard]] Eigen::Vector2d shift(const Eigen::Vector2d& px) const {
    return row(px.y()).at(along(px.x()));
  }
  [[nodiscard]] Eigen::Vector2d straight(const Eigen::Vector2d& px) const { return px + shift(px); }
  /// Where the pixel is that straight() takes to this place.
  [[nodiscard]] Eigen::Vector2d distorted(const Eigen::Vector2d& straight_px) const;
  /// Derivative of distorted() at this pixel.
  [[nodiscard]] Eigen::Matrix2d distorted_by_straight(const Eigen::Vector2d& px) const;

 private:
  bool moves_ = false;
  Eigen::Vector2d middle_px_{0, 0};
  double reach_px_ = 1;
  std::array<std::array<Eigen::Vector2d, 4>, 4> by_y_x_{};  ///< coefficient of y^i x^j
};

/// How a lens whose lines bend by `curvature_per_px` at the corners of the image, and by less towards its
/// middle (the first term of radial distortion), moves a pixel.
[[nodiscard]] Eigen::Vector2d unknown_lens_shift(const Eigen::Vector2d& image_px, double curvature_per_px,
                                                 const Eigen::Vector2d& px);

}  // namespace waymark::refinement
