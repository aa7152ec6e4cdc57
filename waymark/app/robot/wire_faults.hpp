#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "waymark/base/random.hpp"

namespace waymark {

/// What a bad cable does to the bytes of a serial wire.
struct WireFaultOptions {
  double noise = 0;    ///< probability of each byte to become another one
  double dropped = 0;  ///< probability of each byte to be lost
  double torn = 0;     ///< probability of each frame to lose its end
};

/// Deterministic by seed.
class WireFaults {
 public:
  WireFaults(const WireFaultOptions& options, std::uint64_t seed) : options_(options), random_(seed) {}

  /// A frame as the other end receives it.
  [[nodiscard]] std::string pass(std::span<const std::uint8_t> frame);

 private:
  WireFaultOptions options_;
  Random random_;
};

}  // namespace waymark
