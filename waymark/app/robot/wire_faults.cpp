#include "waymark/app/robot/wire_faults.hpp"

namespace waymark {

std::string WireFaults::pass(std::span<const std::uint8_t> frame) {
  constexpr std::uint64_t kValues = 256;
  if (!frame.empty() && random_.uniform() < options_.torn) frame = frame.first(random_.index(frame.size()));
  std::string received;
  for (const std::uint8_t byte : frame) {
    if (random_.uniform() < options_.dropped) continue;
    const bool hurt = random_.uniform() < options_.noise;
    received.push_back(static_cast<char>(hurt ? random_.index(kValues) : byte));
  }
  return received;
}

}  // namespace waymark
