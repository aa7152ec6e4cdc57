#pragma once

#include <string>

#include "waymark/robots/mbot/lcm_link.hpp"

/// What programs of Waymark say of themselves on LCM, where messages do not tell who sent them.
namespace waymark {

/// A simulated MBot (`waymark robot-sim --mbot`), and who drives.
inline constexpr const char* kSimulatorChannel = "WAYMARK_SIMULATOR";
inline constexpr const char* kDriverChannel = "WAYMARK_DRIVER";

/// Names this process on a channel, as text, ten times a second however often it is called.
class Presence {
 public:
  void publish(LcmLink& link, const char* channel);

 private:
  Duration next_{};
};

/// Fails when an MBot is heard at this address within 0.4 s: two on one network are driven by one driver, and
/// their samples cannot be told apart. For who is about to be one.
[[nodiscard]] Status no_mbot_at(const std::string& address);

/// The name in such a message, as far as it can be shown.
[[nodiscard]] std::string presence_of(ByteSpan payload);

}  // namespace waymark
