#pragma once

#include <cstddef>
#include <vector>

namespace waymark::render {

/// A texture that repeats in both directions, and half, quarter, … sizes of it (Williams, "Pyramidal
/// parametrics", SIGGRAPH 1983). Values from -1 to 1 with mean 0.
class SurfaceTexture {
 public:
  /// `kind` is an index in kFloorTextures. Kinds differ in what they show, not in size.
  explicit SurfaceTexture(int kind);

  /// Cells (tiles, planks, largest blobs) from one repetition to the next.
  static constexpr int kCells = 8;
  /// Texels in a cell of the finest level.
  static constexpr int kTexelsPerCell = 64;

  /// The two levels that are nearest in size to a footprint of so many texels of the finest level.
  struct Level {
    const float* fine = nullptr;
    const float* coarse = nullptr;
    int fine_size = 1, coarse_size = 1;  ///< [texel], powers of 2
    float to_coarse = 0;                 ///< share of the coarser one
  };
  [[nodiscard]] Level level(double texels) const;

  /// The value at (u, v) [cells].
  [[nodiscard]] static float at(const Level& level, float u, float v);

 private:
  [[nodiscard]] const float* texels(std::size_t level) const { return levels_[level].data(); }
  std::vector<std::vector<float>> levels_;
};

/// Made when first asked for, once for all. Thread-safe.
[[nodiscard]] const SurfaceTexture& surface_texture(int kind);

}  // namespace waymark::render
