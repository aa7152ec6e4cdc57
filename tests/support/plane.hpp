#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Core>

namespace waymark::testing {

/// Radiance per sample, 1 at saturation of the sensor.
struct Plane {
  int width = 0;
  int height = 0;
  std::vector<float> value;
  Plane(int w, int h)
      : width(w), height(h), value(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  [[nodiscard]] float& at(int x, int y) {
    return value[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  [[nodiscard]] float near(int x, int y) const {
    const auto i = static_cast<std::size_t>(std::clamp(x, 0, width - 1));
    return value[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * static_cast<std::size_t>(width) +
                 i];
  }
  void each(const std::function<float(int, int)>& make) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) at(x, y) = make(x, y);
    }
  }
};

inline Plane convolved(const Plane& from, const std::vector<float>& kernel, bool along_x) {
  const int reach = static_cast<int>(kernel.size() / 2);
  Plane to(from.width, from.height);
  to.each([&](int x, int y) {
    float sum = 0;
    for (int i = -reach; i <= reach; ++i) {
      sum +=
          kernel[static_cast<std::size_t>(i + reach)] * from.near(along_x ? x + i : x, along_x ? y : y + i);
    }
    return sum;
  });
  return to;
}

inline Plane blurred(const Plane& from, double sigma) {
  if (sigma <= 0) return from;
  const int reach = static_cast<int>(std::ceil(4 * sigma));
  std::vector<float> kernel;
  float total = 0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
    total += kernel.back();
  }
  for (float& weight : kernel) weight /= total;
  return convolved(convolved(from, kernel, true), kernel, false);
}

/// The mean of the samples at `offsets`, interpolated.
inline Plane smeared(const Plane& from, const std::vector<Eigen::Vector2d>& offsets) {
  Plane to(from.width, from.height);
  to.each([&](int x, int y) {
    float sum = 0;
    for (const Eigen::Vector2d& offset : offsets) {
      const double fx = std::clamp(x + offset.x(), 0.0, from.width - 1.001);
      const double fy = std::clamp(y + offset.y(), 0.0, from.height - 1.001);
      const int ix = static_cast<int>(fx);
      const int iy = static_cast<int>(fy);
      const auto dx = static_cast<float>(fx - ix);
      const auto dy = static_cast<float>(fy - iy);
      sum += (1 - dy) * ((1 - dx) * from.near(ix, iy) + dx * from.near(ix + 1, iy)) +
             dy * ((1 - dx) * from.near(ix, iy + 1) + dx * from.near(ix + 1, iy + 1));
    }
    return sum / static_cast<float>(offsets.size());
  });
  return to;
}

inline std::vector<Eigen::Vector2d> disc(double radius) {
  std::vector<Eigen::Vector2d> offsets;
  const int reach = static_cast<int>(std::ceil(radius));
  for (int i = -reach; i <= reach; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      if (Eigen::Vector2d(i, j).norm() <= radius) offsets.emplace_back(i, j);
    }
  }
  return offsets;
}

inline std::vector<Eigen::Vector2d> line(double length, double direction_rad) {
  std::vector<Eigen::Vector2d> offsets;
  const int steps = static_cast<int>(std::ceil(2 * length)) + 1;
  for (int i = 0; i < steps; ++i) {
    const double t = length * ((i + 0.5) / steps - 0.5);
    offsets.emplace_back(t * std::cos(direction_rad), t * std::sin(direction_rad));
  }
  return offsets;
}

}  // namespace waymark::testing
