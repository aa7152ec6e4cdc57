#include <algorithm>
#include <set>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/doctor/doctor_network.hpp"
#include "waymark/recording/lcm/mbot_messages.hpp"
#include "waymark/robots/mbot/presence.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr const char* kMbotHowTo = "docs/howto/mbot.md";

/// What comes on all channels while it listens.
class MbotListener {
 public:
  Status listen(LcmLink& link, Duration most, const DoctorCancelled& cancelled) {
    if (Status status = link.subscribe(".*"); !status) return status;
    const Duration until = steady_now() + most;
    while (steady_now() < until && !cancelled()) {
      const auto message = link.next(std::min(kDoctorSlice, until - steady_now()));
      if (!message) return tl::unexpected(message.error());
      if (*message) receive(**message);
    }
    heard_.listened_s = to_seconds(most);
    heard_.there =
        channels_.empty() ? "nothing was heard" : fmt::format("heard: {}", fmt::join(channels_, ", "));
    return {};
  }
  [[nodiscard]] const NetworkHeard& heard() const { return heard_; }
  [[nodiscard]] bool simulated() const { return channels_.contains(kSimulatorChannel); }

 private:
  void receive(const LcmMessage& message) {
    channels_.insert(message.channel);
    if (message.channel == kDriverChannel) heard_.driver = presence_of(message.payload);
    if (message.channel == heard_.commands && mbot::decode<mbot::Twist2D>(message.payload))
      ++heard_.others_commands;
    if (message.channel != heard_.odometry) return;
    ++heard_.odometries;
    const auto utime = mbot::utime_of(message.payload);
    if (!utime || *utime == 0) return;
    const double behind_s = 1e-6 * static_cast<double>(message.received_us - *utime);
    heard_.behind_s = std::min(heard_.behind_s.value_or(behind_s), behind_s);
  }

  NetworkHeard heard_{.odometry = "MBOT_ODOMETRY", .commands = "MBOT_VEL_CMD"};
  std::set<std::string> channels_{};
};

}  // namespace

std::vector<DoctorLine> check_mbot(const std::string& address, const DoctorCancelled& cancelled) {
  constexpr Duration kListen = std::chrono::milliseconds(1500);
  const auto link = open_lcm(address);
  MbotListener listener;
  const Status status = link ? listener.listen(**link, kListen, cancelled) : tl::unexpected(link.error());
  if (!status) return {{"robot", DoctorLevel::Fail, status.error().message, status.error().hint}};
  std::vector<DoctorLine> lines = network_lines(listener.heard(), kMbotHowTo);
  if (listener.simulated()) lines.front().words += "; it is simulated";
  return lines;
}

}  // namespace waymark
