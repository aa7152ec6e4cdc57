#include "waymark/tags/soft_bits.hpp"

#include <cmath>
#include <cstddef>

namespace waymark::search {

float evidence_bits(std::span<const float> distances, std::span<const std::uint16_t> cells,
                    std::uint64_t wrong_bits) {
  constexpr float kSteepness = 8;     // 2 mu^2 / sigma^2 of levels at +-mu with noise of mu / 2
  constexpr float kOutliers = 0.06F;  // share of cells that dirt, gloss or a shadow decide
  float mean = 0;
  for (const std::uint16_t at : cells) mean += std::abs(distances[at]);
  mean /= static_cast<float>(cells.size());
  if (!(mean > 0)) return 0;
  float evidence = 0;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const bool wrong = ((wrong_bits >> (cells.size() - 1 - k)) & 1U) != 0;
    const float towards = std::abs(distances[cells[k]]) * (wrong ? -1.0F : 1.0F);
    const float likely = 1 / (1 + std::exp(-kSteepness * towards / mean));
    evidence += std::log2(kOutliers + (1 - kOutliers) * 2 * likely);
  }
  return evidence;
}

}  // namespace waymark::search
