#include "waymark/simulation/render/ray_table.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace waymark::render {
namespace {

constexpr double kMinDepth = 0.15;  // minimum depth of unit rays stored as (x, y, 1): 81 degrees off axis

}  // namespace

float& RayTable::at(int axis, int x, int y) {
  return rays_[(static_cast<std::size_t>(axis) * static_cast<std::size_t>(height_ + 1) +
                static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(width_ + 1) +
               static_cast<std::size_t>(x)];
}

Eigen::Vector3d RayTable::ray(int x, int y) const {
  return {static_cast<double>(rays(0, y)[x]), static_cast<double>(rays(1, y)[x]),
          static_cast<double>(rays(2, y)[x])};
}

void RayTable::add_ray(int x, int y, const CameraModel& camera) {
  const auto bearing = camera.unproject({x, y});
  const Eigen::Vector3d direction = bearing.value_or(Eigen::Vector3d::UnitZ());
  seen_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) + static_cast<std::size_t>(x)] =
      bearing ? 1 : 0;
  for (int axis = 0; axis < 3; ++axis) at(axis, x, y) = static_cast<float>(direction[axis]);
}

RayTable::RayTable(const CameraModel& camera) : width_(camera.width_px()), height_(camera.height_px()) {
  const auto corners = static_cast<std::size_t>(width_ + 1) * static_cast<std::size_t>(height_ + 1);
  rays_.resize(3 * corners);
  seen_.resize(corners);
  for (int y = 0; y <= height_; ++y) {
    for (int x = 0; x <= width_; ++x) add_ray(x, y, camera);
  }
  const auto seen = [&](int x, int y) {
    return seen_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) +
                 static_cast<std::size_t>(x)] != 0;
  };
  cosines_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const bool whole = seen(x, y) && seen(x + 1, y) && seen(x, y + 1) && seen(x + 1, y + 1);
      cosines_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)] =
          whole ? std::max(0.0F, (rays(2, y)[x] + rays(2, y + 1)[x + 1]) / 2) : -1.0F;
    }
  }
  for (int row = 0; row < tile_rows(); ++row) {
    for (int column = 0; column < tile_columns(); ++column) add_tile(column, row);
  }
  const std::size_t middle = tiles_.size() / 2 + static_cast<std::size_t>(tile_columns() / 2);
  px_per_rad_ =
      kTilePx / std::max(1e-6, tiles_[std::min(middle, tiles_.size() - 1)].angle_rad * std::sqrt(2.0));
  const float least =
      *std::min_element(rays_.begin() + static_cast<std::ptrdiff_t>(2 * corners), rays_.end());
  if (static_cast<double>(least) < kMinDepth) return;
  for (std::size_t i = 0; i < corners; ++i) {
    const double z = static_cast<double>(rays_[2 * corners + i]);
    rays_[i] = static_cast<float>(static_cast<double>(rays_[i]) / z);
    rays_[corners + i] = static_cast<float>(static_cast<double>(rays_[corners + i]) / z);
    rays_[2 * corners + i] = 1;
  }
}

void RayTable::add_tile(int column, int row) {
  Tile tile;
  tile.x = column * kTilePx;
  tile.y = row * kTilePx;
  tile.width = std::min(kTilePx, width_ - tile.x);
  tile.height = std::min(kTilePx, height_ - tile.y);
  const auto each = [&](auto&& use) {
    for (int y = tile.y; y <= tile.y + tile.height; ++y) {
      for (int x = tile.x; x <= tile.x + tile.width; ++x) {
        if (seen_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) +
                  static_cast<std::size_t>(x)] != 0)
          use(ray(x, y).normalized());
      }
    }
  };
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  each([&](const Eigen::Vector3d& ray) { sum += ray; });
  tile.sees = sum.norm() > 0;
  if (tile.sees) tile.cam_ray = sum.normalized();
  each([&](const Eigen::Vector3d& ray) {
    tile.angle_rad =
        std::max(tile.angle_rad, std::atan2(ray.cross(tile.cam_ray).norm(), ray.dot(tile.cam_ray)));
  });
  tiles_.push_back(tile);
}

}  // namespace waymark::render
