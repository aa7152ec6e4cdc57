#include "waymark/simulation/surface_texture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "waymark/simulation/counter_noise.hpp"
#include "waymark/simulation/world.hpp"

namespace waymark::render {
namespace {

constexpr int kSize = SurfaceTexture::kCells * SurfaceTexture::kTexelsPerCell;

double blend(double t) { return t * t * (3 - 2 * t); }

double lattice(int octave, int count, int i, int j) {
  const int place = (j % count) * 0x4000 + i % count;
  const std::uint64_t key = mix(static_cast<std::uint64_t>(octave)) + static_cast<std::uint64_t>(place);
  return static_cast<double>(mix(key) >> 11U) * 0x1.0p-52 - 1.0;
}

/// Value noise that repeats after `count` cells (Lewis, "Algorithms for solid noise synthesis", SIGGRAPH
/// 1989).
double value_noise(int octave, int count, double x, double y) {
  const int i = static_cast<int>(x);
  const int j = static_cast<int>(y);
  const double u = blend(x - i);
  const double v = blend(y - j);
  const double above = lattice(octave, count, i, j) * (1 - u) + lattice(octave, count, i + 1, j) * u;
  const double below = lattice(octave, count, i, j + 1) * (1 - u) + lattice(octave, count, i + 1, j + 1) * u;
  return above * (1 - v) + below * v;
}

double speckle(double u, double v) {
  double sum = 0;
  double amplitude = 0.4;
  for (int octave = 0; octave < 5; ++octave, amplitude *= 0.75) {
    const int scale = 1 << octave;
    sum += amplitude * value_noise(octave, SurfaceTexture::kCells * scale, u * scale, v * scale);
  }
  return std::clamp(sum, -1.0, 1.0);
}

double tiles(double u, double v) {
  constexpr double kJoint = 0.03;  // of a cell
  const double x = u - std::floor(u);
  const double y = v - std::floor(v);
  if (x < kJoint || y < kJoint) return -1;
  return 0.15 * speckle(u, v) +
         0.25 * lattice(9, SurfaceTexture::kCells, static_cast<int>(u), static_cast<int>(v));
}

double checker(double u, double v) {
  return (static_cast<int>(u) + static_cast<int>(v)) % 2 == 0 ? 1.0 : -1.0;
}

double value(int kind, double u, double v) {
  constexpr int kTiles = 1;
  constexpr int kChecker = 2;
  constexpr int kSpeckle = 3;
  if (kind == kTiles) return tiles(u, v);
  if (kind == kChecker) return checker(u, v);
  return kind == kSpeckle ? speckle(u, v) : 0.0;
}

std::vector<float> halved(const std::vector<float>& fine, int size) {
  const auto n = static_cast<std::size_t>(size);
  std::vector<float> coarse(n * n / 4);
  for (std::size_t y = 0; y < n / 2; ++y) {
    for (std::size_t x = 0; x < n / 2; ++x) {
      const float* from = fine.data() + 2 * y * n + 2 * x;
      coarse[y * n / 2 + x] = (from[0] + from[1] + from[n] + from[n + 1]) / 4;
    }
  }
  return coarse;
}

/// Far quicker than std::floor where there is no instruction for it.
std::int32_t whole(float x) {
  const auto towards_zero = static_cast<std::int32_t>(x);
  return towards_zero - (x < static_cast<float>(towards_zero) ? 1 : 0);
}

float bilinear(const float* texels, int size, float u, float v) {
  const float x = u - 0.5F;
  const float y = v - 0.5F;
  const std::int32_t i = whole(x);
  const std::int32_t j = whole(y);
  const float dx = x - static_cast<float>(i);
  const float dy = y - static_cast<float>(j);
  const auto mask = static_cast<std::uint32_t>(size - 1);  // a power of 2: wraps negative numbers as well
  const auto n = static_cast<std::size_t>(size);
  const auto left = static_cast<std::uint32_t>(i);
  const auto top = static_cast<std::uint32_t>(j);
  const std::size_t x0 = left & mask;
  const std::size_t x1 = (left + 1) & mask;
  const float* above = texels + (top & mask) * n;
  const float* below = texels + ((top + 1) & mask) * n;
  const float a = above[x0] + dx * (above[x1] - above[x0]);
  const float b = below[x0] + dx * (below[x1] - below[x0]);
  return a + dy * (b - a);
}

}  // namespace

SurfaceTexture::SurfaceTexture(int kind) {
  std::vector<float> finest(static_cast<std::size_t>(kSize) * kSize);
  double sum = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double at = value(kind, (x + 0.5) / kTexelsPerCell, (y + 0.5) / kTexelsPerCell);
      finest[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)] = static_cast<float>(at);
      sum += at;
    }
  }
  const auto mean = static_cast<float>(sum / (static_cast<double>(kSize) * kSize));
  for (float& texel : finest) texel -= mean;
  levels_.push_back(std::move(finest));
  for (int size = kSize; size > 1; size /= 2) levels_.push_back(halved(levels_.back(), size));
}

SurfaceTexture::Level SurfaceTexture::level(double texels) const {
  const double last = static_cast<double>(levels_.size() - 1);
  const double wanted =
      std::isfinite(texels) ? std::clamp(std::log2(std::max(texels, 1.0)), 0.0, last) : last;
  const auto fine = static_cast<std::size_t>(wanted);
  const std::size_t coarse = std::min(fine + 1, levels_.size() - 1);
  return {.fine = this->texels(fine),
          .coarse = this->texels(coarse),
          .fine_size = kSize >> fine,
          .coarse_size = kSize >> coarse,
          .to_coarse = static_cast<float>(wanted - static_cast<double>(fine))};
}

float SurfaceTexture::at(const Level& level, float u, float v) {
  const float fine_scale = static_cast<float>(level.fine_size) / kCells;
  const float coarse_scale = static_cast<float>(level.coarse_size) / kCells;
  const float fine = bilinear(level.fine, level.fine_size, u * fine_scale, v * fine_scale);
  if (level.to_coarse < 0.05F) return fine;
  const float coarse = bilinear(level.coarse, level.coarse_size, u * coarse_scale, v * coarse_scale);
  return fine + level.to_coarse * (coarse - fine);
}

namespace {

template <int kKind>
const SurfaceTexture& texture_of_kind() {
  static const SurfaceTexture kTexture(kKind);
  return kTexture;
}

}  // namespace

const SurfaceTexture& surface_texture(int kind) {
  static_assert(kFloorTextures.size() == 4);
  switch (kind) {
    case 1:
      return texture_of_kind<1>();
    case 2:
      return texture_of_kind<2>();
    case 3:
      return texture_of_kind<3>();
    default:
      return texture_of_kind<0>();
  }
}

}  // namespace waymark::render
