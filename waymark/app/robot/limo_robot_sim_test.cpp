// Tests that cable faults occur at the specified rates and are the same for the same seed.
#include "waymark/app/robot/limo_robot_sim.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace waymark {
namespace {

constexpr int kFrames = 4000;
const std::vector<std::uint8_t> kFrame = {0x55, 0x0e, 0x02, 0x21, 1, 2, 3, 4, 5, 6, 7, 8, 9, 0x7f};

/// Number of bytes received from `kFrames` frames, and number of changed bytes in complete frames.
struct Received {
  double bytes = 0, changed = 0, whole = 0;
};

Received received_through(const WireFaultOptions& options) {
  WireFaults wire(options, 7);
  Received all;
  for (int i = 0; i < kFrames; ++i) {
    const std::string frame = wire.pass(kFrame);
    all.bytes += static_cast<double>(frame.size());
    if (frame.size() != kFrame.size()) continue;
    ++all.whole;
    for (std::size_t k = 0; k < kFrame.size(); ++k)
      if (static_cast<std::uint8_t>(frame[k]) != kFrame[k]) ++all.changed;
  }
  return all;
}

TEST(WireFaults, AGoodCablePassesEveryByte) {
  const Received all = received_through({});
  EXPECT_EQ(all.whole, kFrames);
  EXPECT_EQ(all.changed, 0);
}

TEST(WireFaults, EachFaultIsAsFrequentAsItsProbability) {
  const double n = static_cast<double>(kFrame.size());
  constexpr double kShare = 0.1;
  const double sent = n * kFrames, five_sigmas = 5 * std::sqrt(kShare * (1 - kShare) * sent);
  EXPECT_NEAR(received_through({.dropped = kShare}).bytes, sent * (1 - kShare), five_sigmas);
  const Received noisy = received_through({.noise = kShare});
  EXPECT_EQ(noisy.bytes, sent);
  EXPECT_NEAR(noisy.changed, sent * kShare * 255 / 256, five_sigmas);
  const Received torn = received_through({.torn = kShare});
  EXPECT_NEAR(torn.whole, kFrames * (1 - kShare), 5 * std::sqrt(kFrames * kShare * (1 - kShare)));
  EXPECT_EQ(received_through({.dropped = 1}).bytes, 0);
}

TEST(WireFaults, TheSameSeedChangesTheSameBytes) {
  const WireFaultOptions options{.noise = 0.2, .dropped = 0.1, .torn = 0.1};
  WireFaults first(options, 3), again(options, 3), other(options, 4);
  bool differs = false;
  for (int i = 0; i < 50; ++i) {
    const std::string frame = first.pass(kFrame);
    EXPECT_EQ(frame, again.pass(kFrame));
    differs |= frame != other.pass(kFrame);
  }
  EXPECT_TRUE(differs);
}

}  // namespace
}  // namespace waymark
