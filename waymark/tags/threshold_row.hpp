#pragma once

#include <cstddef>
#include <cstdint>

#include "waymark/tags/plane_kernels.hpp"

namespace waymark::search {

/// PlaneKernels::thresholds as loops that a compiler makes vectors of; each `Processor` is a version of its
/// own, compiled with what that processor can do.
template <class Processor>
struct ThresholdRow {
  static void run(const std::uint8_t* __restrict low, const std::uint8_t* __restrict high, std::size_t count,
                  const ThresholdRule& rule, std::uint8_t* __restrict thresholds) {
    const std::uint16_t share = rule.share_256;
    const std::uint8_t gate = rule.gate;
    for (std::size_t i = 0; i < count; ++i) {
      const auto range = static_cast<std::uint16_t>(high[i] - low[i]);
      const auto step = static_cast<std::uint8_t>(static_cast<std::uint16_t>(range * share + 128U) >> 8U);
      thresholds[i] = rule.dark ? static_cast<std::uint8_t>(range < gate ? 0 : low[i] + step)
                                : static_cast<std::uint8_t>(range < gate ? 255 : high[i] - step);
    }
  }
};

}  // namespace waymark::search
