// Any bytes from LIMO's serial port: frames are found again in their own bytes, and every sample of them is a
// valid line of a robot process.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>

#include "waymark/robots/limo/command_gate.hpp"
#include "waymark/robots/limo/limo_bridge.hpp"
#include "waymark/robots/process/robot_messages.hpp"

namespace {

using namespace waymark;

/// Stamps of a kind increase, and all numbers are finite.
void check_samples(const std::vector<Sample>& samples, std::map<std::size_t, SensorTime>& newest) {
  for (const Sample& sample : samples) {
    const SensorTime stamp = stamp_of(sample);
    const auto [known, first] = newest.emplace(sample.index(), stamp);
    if (!first && stamp <= known->second) std::abort();
    known->second = stamp;
    const auto* const odometry = std::get_if<Odometry>(&sample);
    if (odometry != nullptr && !odometry->odom_T_base.translation().allFinite()) std::abort();
    RobotMessageReader reader("fuzz");
    if (!reader.read({.number = 1, .text = to_line(RobotHello{.name = "fuzz"})})) std::abort();
    const auto again = reader.read({.number = 2, .text = to_line(sample)});
    if (!again || !*again) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  LimoReader reader;
  LimoBridge bridge(0.045);
  CommandGate gate(LimoDrive::Differential);
  std::map<std::size_t, SensorTime> newest;
  Duration now = std::chrono::seconds(1);
  std::uint64_t taken = 0;
  for (std::size_t at = 0; at < size; at += 5) {
    reader.add({data + at, std::min<std::size_t>(5, size - at)});
    now += std::chrono::milliseconds(data[at]);
    while (const auto frame = reader.next()) {
      ++taken;
      LimoReader again;
      again.add(encode(*frame));
      if (again.next() != frame) std::abort();
      if (const auto state = decode_state(*frame)) gate.receive(*state, now);
      if (const auto motion = decode_motion(*frame)) gate.receive(*motion, now);
      check_samples(bridge.receive(*frame, gate.drive(), now, (data[at] & 1U) != 0), newest);
      const VelocityCommand passed = gate.pass({0.3, 0.1}, now);
      if (passed.speed_m_s != 0 && !gate.ready()) std::abort();
      (void)gate.asks_for_command(now);
    }
  }
  if (taken * kLimoFrameBytes + reader.skipped() > size) std::abort();
  return 0;
}
