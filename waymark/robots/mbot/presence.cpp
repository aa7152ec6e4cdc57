#include "waymark/robots/mbot/presence.hpp"

#include <algorithm>

#include "waymark/base/message_text.hpp"
#include "waymark/robots/process/sender_watch.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {

void Presence::publish(LcmLink& link, const char* channel) {
  constexpr Duration kPeriod = std::chrono::milliseconds(100);
  const Duration now = steady_now();
  if (now < next_) return;
  next_ = now + kPeriod;
  const std::string name = name_of_this_process();
  const Bytes payload(name.begin(), name.end());
  (void)link.publish(channel, payload);  // what is not sent now is said again soon
}

Status no_mbot_at(const std::string& address) {
  constexpr Duration kListen = std::chrono::milliseconds(400);
  const auto link = open_lcm(address);
  if (!link) return tl::unexpected(link.error());
  if (Status status = (*link)->subscribe("MBOT_ODOMETRY|WAYMARK_SIMULATOR"); !status) return status;
  std::string who;
  bool heard = false;
  const Duration until = steady_now() + kListen;
  while (steady_now() < until) {
    const auto message = (*link)->next(until - steady_now());
    if (!message) return tl::unexpected(message.error());
    if (!*message) continue;
    heard = true;
    if ((*message)->channel == kSimulatorChannel) who = ": " + presence_of((*message)->payload);
  }
  if (!heard) return {};
  return fail(
      ErrorCode::InvalidArgument, "an MBot sends its odometry at this address already" + who,
      {.source = address},
      "End it, or name another port: udpm://239.255.76.67:7668?ttl=0, and the same in --robot mbot:.");
}

std::string presence_of(ByteSpan payload) {
  constexpr std::size_t kMost = 120;
  const auto shown = payload.first(std::min(payload.size(), kMost));
  return printable(std::string(shown.begin(), shown.end()));
}

}  // namespace waymark
