#include "waymark/simulation/render/counter_noise.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace waymark::render {
namespace {

constexpr std::size_t kQuantiles = 4096;
using Table = std::array<float, kQuantiles>;

/// Inverse of the normal distribution function, computed by bisection.
double quantile(double share) {
  double low = -10;
  double high = 10;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (0.5 * std::erfc(-middle / std::numbers::sqrt2) < share ? low : high) = middle;
  }
  return (low + high) / 2;
}

/// The mean quantiles, scaled so that the sum of two of them has variance 1.
Table make_table() {
  Table table{};
  double squares = 0;
  for (std::size_t i = 0; i < kQuantiles / 2; ++i) {
    const double z = quantile((static_cast<double>(i) + 0.5) / kQuantiles);
    squares += 2 * z * z;
    table[i] = static_cast<float>(z);
  }
  const double scale = 1 / std::sqrt(2 * squares / kQuantiles);
  for (std::size_t i = 0; i < kQuantiles / 2; ++i) {
    table[i] = static_cast<float>(static_cast<double>(table[i]) * scale);
    table[kQuantiles - 1 - i] = -table[i];
  }
  return table;
}

}  // namespace

void normals(std::uint64_t key, std::uint64_t first, int count, float* out) {
  static const Table kTable = make_table();
  constexpr std::uint64_t kMask = kQuantiles - 1;
  const auto pick = [](std::uint64_t bits, unsigned shift) { return kTable[(bits >> shift) & kMask]; };
  const std::uint64_t stream = mix(key);
  for (int i = 0; i < count; i += 2) {
    const std::uint64_t bits = mix(stream + (first + static_cast<std::uint64_t>(i)) / 2);
    out[i] = pick(bits, 0) + pick(bits, 12);
    if (i + 1 < count) out[i + 1] = pick(bits, 24) + pick(bits, 36);
  }
}

}  // namespace waymark::render
