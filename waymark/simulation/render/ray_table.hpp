#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"

namespace waymark::render {

/// Index of (row, column) in an array of rows of `width`. Arguments must not be negative.
[[nodiscard]] constexpr std::size_t row_major(int row, int width, int column = 0) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
}

inline constexpr int kTilePx = 16;  ///< side of the square tiles of the image
/// Rays of a tile's pixel corners in a row.
inline constexpr int kTileCorners = kTilePx + 1;

/// The line of sight of every pixel corner, computed once per camera, so distortion costs nothing during
/// rendering.
///
/// Rays are (x, y, 1) if all of the image is well in front of the camera; otherwise they have length 1.
/// Without distortion, linear functions of rays (x, y, 1) are linear in the pixels.
class RayTable {
 public:
  /// O(pixels).
  explicit RayTable(const CameraModel& camera);

  /// The view of one tile: directions within an angle of the middle one.
  struct Tile {
    int x = 0, y = 0;           ///< its first pixel
    int width = 0, height = 0;  ///< [px], less than kTilePx at the right and bottom edges
    Eigen::Vector3d cam_ray = Eigen::Vector3d::UnitZ();  ///< unit
    double angle_rad = 0;                                ///< to the farthest ray of the tile
    bool sees = false;                                   ///< whether any of its pixels has rays
  };

  [[nodiscard]] int width_px() const { return width_; }
  [[nodiscard]] int height_px() const { return height_; }
  [[nodiscard]] int tile_columns() const { return (width_ + kTilePx - 1) / kTilePx; }
  [[nodiscard]] int tile_rows() const { return (height_ + kTilePx - 1) / kTilePx; }
  [[nodiscard]] const Tile& tile(int column, int row) const {
    return tiles_[row_major(row, tile_columns(), column)];
  }
  /// Coordinate 0, 1 or 2 of the width + 1 rays of corner row y.
  [[nodiscard]] const float* rays(int axis, int y) const {
    return rays_.data() + (static_cast<std::size_t>(axis) * static_cast<std::size_t>(height_ + 1) +
                           static_cast<std::size_t>(y)) *
                              static_cast<std::size_t>(width_ + 1);
  }
  /// Cosine between the optical axis and each pixel of row y; below 0 for pixels without a ray.
  [[nodiscard]] const float* cosines(int y) const {
    return cosines_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
  }
  /// Pixels per radian of viewing direction, averaged over the image.
  [[nodiscard]] double px_per_rad() const { return px_per_rad_; }

 private:
  void add_ray(int x, int y, const CameraModel& camera);
  void add_tile(int column, int row);
  [[nodiscard]] Eigen::Vector3d ray(int x, int y) const;
  float& at(int axis, int x, int y);

  int width_ = 0;
  int height_ = 0;
  double px_per_rad_ = 0;
  std::vector<float> rays_;
  std::vector<std::uint8_t> seen_;  ///< of each corner
  std::vector<float> cosines_;
  std::vector<Tile> tiles_;
};

}  // namespace waymark::render
