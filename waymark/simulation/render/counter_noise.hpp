#pragma once

#include <cstdint>

namespace waymark::render {

/// splitmix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).
/// Computes a random number from a counter, so that the noise of any pixel can be computed independently of
/// other pixels (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011).
[[nodiscard]] constexpr std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31U);
}

/// Generates `count` standard normal numbers of stream `key`, starting at the even index `first`. Each is the
/// sum of two out of 4096 quantiles. The distribution is smooth to 0.001 and reaches 5 standard deviations;
/// its variance is 1 to within 1e-6.
void normals(std::uint64_t key, std::uint64_t first, int count, float* out);

}  // namespace waymark::render
