#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/recording/byte_io.hpp"

namespace waymark {

/// The default LCM address; with ttl=0, messages stay on this computer.
inline constexpr const char* kLcmDefaultAddress = "udpm://239.255.76.67:7667?ttl=0";

struct LcmMessage {
  std::string channel{};
  Bytes payload{};
  Duration arrived{};            ///< time on the steady clock
  std::int64_t received_us = 0;  ///< since 1970, according to this computer's clock
};

/// A connection to an LCM network (Huang, Olson and Moore, "LCM: Lightweight Communications and Marshalling",
/// IROS 2010).
class LcmLink {
 public:
  virtual ~LcmLink() = default;
  LcmLink(const LcmLink&) = delete;
  LcmLink& operator=(const LcmLink&) = delete;

  /// Subscribes to all channels whose full name matches the regular expression. At most a thousand messages
  /// are queued.
  virtual Status subscribe(const std::string& channels) = 0;
  /// May be called from any thread. Fails if the message cannot be sent.
  virtual Status publish(const std::string& channel, ByteSpan payload) = 0;
  /// The oldest queued message; `nullopt` if none arrives within `timeout`.
  virtual Result<std::optional<LcmMessage>> next(Duration timeout) = 0;

 protected:
  LcmLink() = default;
};

/// Checks the address of a UDP multicast group, such as "udpm://239.255.76.67:7667?ttl=0". An empty text
/// selects the default address. Fails with the reason if the address is invalid.
[[nodiscard]] Result<std::string> lcm_address(const std::string& text);

/// Joins the group. Fails if liblcm is missing or no network is available.
[[nodiscard]] Result<std::unique_ptr<LcmLink>> open_lcm(const std::string& address);

// Channels on which Waymark programs announce themselves, because LCM messages do not contain their sender.

/// Channels used by a simulated MBot (`waymark robot-sim mbot=true`) and by the driving program.
inline constexpr const char* kSimulatorChannel = "WAYMARK_SIMULATOR";
inline constexpr const char* kDriverChannel = "WAYMARK_DRIVER";

/// Publishes the name of this process on a channel as text, at most ten times a second.
class Presence {
 public:
  void publish(LcmLink& link, const char* channel);

 private:
  Duration next_{};
};

/// Fails if an MBot is detected at this address within 0.4 s. Two robots on the same network would obey the
/// same driver, and their samples would be indistinguishable. A simulated MBot checks this before it starts.
[[nodiscard]] Status no_mbot_at(const std::string& address);

/// The name in such a message, in printable form and limited to 120 bytes.
[[nodiscard]] std::string presence_of(ByteSpan payload);

}  // namespace waymark
