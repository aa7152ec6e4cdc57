#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"

namespace waymark::render {

/// Index of (row, column) in an array whose rows have `width` elements. Arguments must not be negative.
[[nodiscard]] constexpr std::size_t row_major(int row, int width, int column = 0) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
}

inline constexpr int kTilePx = 16;  ///< side length of the square tiles that make up the image
/// Number of pixel-corner rays in a row of a tile.
inline constexpr int kTileCorners = kTilePx + 1;

/// The line of sight through every pixel corner, computed once per camera, so that distortion costs nothing
/// during rendering.
///
/// Rays are stored as (x, y, 1) if all of the image is well in front of the camera; otherwise they have
/// length 1. Without distortion, functions that are linear in rays (x, y, 1) are linear in the pixel
/// position.
class RayTable {
 public:
  /// O(pixels).
  explicit RayTable(const CameraModel& camera);

  /// The view through one tile: directions within an angle of the middle one.
  struct Tile {
    int x = 0, y = 0;           ///< first pixel of the tile
    int width = 0, height = 0;  ///< [px], less than kTilePx at the right and bottom edges
    Eigen::Vector3d cam_ray = Eigen::Vector3d::UnitZ();  ///< unit vector to the middle of the tile
    double angle_rad = 0;                                ///< angle to the farthest ray of the tile
    bool sees = false;                                   ///< whether any pixel of the tile has rays
  };

  [[nodiscard]] int width_px() const { return width_; }
  [[nodiscard]] int height_px() const { return height_; }
  [[nodiscard]] int tile_columns() const { return (width_ + kTilePx - 1) / kTilePx; }
  [[nodiscard]] int tile_rows() const { return (height_ + kTilePx - 1) / kTilePx; }
  [[nodiscard]] const Tile& tile(int column, int row) const {
    return tiles_[row_major(row, tile_columns(), column)];
  }
  /// Component 0, 1 or 2 (`axis`) of the width + 1 rays in corner row y.
  [[nodiscard]] const float* rays(int axis, int y) const {
    return rays_.data() + (static_cast<std::size_t>(axis) * static_cast<std::size_t>(height_ + 1) +
                           static_cast<std::size_t>(y)) *
                              static_cast<std::size_t>(width_ + 1);
  }
  /// Cosine of the angle between the optical axis and each pixel of row y; below 0 for pixels without a ray.
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
  std::vector<std::uint8_t> seen_;  ///< whether each corner has a ray
  std::vector<float> cosines_;
  std::vector<Tile> tiles_;
};

}  // namespace waymark::render
