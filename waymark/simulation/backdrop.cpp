#include "waymark/simulation/backdrop.hpp"

#include <cmath>

namespace waymark::photo {
namespace {

/// splitmix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).
std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31U);
}

/// The value at a point of the lattice, in [-1, 1).
double lattice(std::uint64_t seed, std::int64_t i, std::int64_t j) {
  const std::uint64_t hash =
      mix(mix(mix(seed) ^ static_cast<std::uint64_t>(i)) ^ static_cast<std::uint64_t>(j));
  return static_cast<double>(hash >> 11U) * 0x1.0p-52 - 1.0;
}

double blend(double t) { return t * t * (3 - 2 * t); }

double value_noise(std::uint64_t seed, double x, double y) {
  const double i = std::floor(x);
  const double j = std::floor(y);
  const auto left = static_cast<std::int64_t>(i);
  const auto top = static_cast<std::int64_t>(j);
  const double u = blend(x - i);
  const double v = blend(y - j);
  const double above = lattice(seed, left, top) * (1 - u) + lattice(seed, left + 1, top) * u;
  const double below = lattice(seed, left, top + 1) * (1 - u) + lattice(seed, left + 1, top + 1) * u;
  return above * (1 - v) + below * v;
}

double clutter(std::uint64_t seed, double size_px, double x, double y) {
  constexpr double kSmallestPx = 4;
  constexpr double kFading = 0.65;  // amplitude of an octave against the one before
  double sum = 0;
  double sum_of_amplitudes = 0;
  double amplitude = 1;
  for (std::uint64_t octave = 0; octave == 0 || size_px >= kSmallestPx;
       ++octave, size_px /= 2, amplitude *= kFading) {
    sum += amplitude * value_noise(seed + octave, x / size_px, y / size_px);
    sum_of_amplitudes += amplitude;
  }
  return sum / sum_of_amplitudes;
}

}  // namespace

double Backdrop::at(double x, double y) const {
  switch (kind) {
    case Kind::Flat:
      return 0;
    case Kind::Gradient:
      return x / width_px + y / height_px - 1;
    case Kind::Clutter:
      break;
  }
  return clutter(seed, size_px, x, y);
}

}  // namespace waymark::photo
