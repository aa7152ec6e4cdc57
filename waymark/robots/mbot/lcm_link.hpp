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

/// Where LCM's programs meet unless told otherwise; with ttl=0 nothing leaves this machine.
inline constexpr const char* kLcmDefaultAddress = "udpm://239.255.76.67:7667?ttl=0";

struct LcmMessage {
  std::string channel{};
  Bytes payload{};
  Duration arrived{};            ///< steady clock
  std::int64_t received_us = 0;  ///< since 1970, by this machine's clock
};

/// A program on the network of LCM (Huang, Olson and Moore, "LCM: Lightweight Communications and
/// Marshalling", IROS 2010).
class LcmLink {
 public:
  virtual ~LcmLink() = default;
  LcmLink(const LcmLink&) = delete;
  LcmLink& operator=(const LcmLink&) = delete;

  /// All channels whose whole name the regular expression matches. At most a thousand messages wait.
  virtual Status subscribe(const std::string& channels) = 0;
  /// From any thread. Fails where nothing can be sent.
  virtual Status publish(const std::string& channel, ByteSpan payload) = 0;
  /// The oldest message that waits; nothing: none came within `most`.
  virtual Result<std::optional<LcmMessage>> next(Duration most) = 0;

 protected:
  LcmLink() = default;
};

/// The address of a group of UDP multicast, "udpm://239.255.76.67:7667?ttl=0"; of nothing the usual one.
/// Fails, and says why, on anything else.
[[nodiscard]] Result<std::string> lcm_address(const std::string& text);

/// Joins the group. Fails where liblcm is missing, or has no network.
[[nodiscard]] Result<std::unique_ptr<LcmLink>> open_lcm(const std::string& address);

// What programs of Waymark say of themselves on LCM, where messages do not tell who sent them.

/// A simulated MBot (`waymark robot-sim mbot=true`), and who drives.
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
