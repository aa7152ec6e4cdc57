// Whatever viewers of a running robot send: three of them (a page with the token, a Foxglove with it, one
// without) take turns, line by line; a line that begins with '!' is binary. Nobody without the token ever
// gives an order but a stop, speeds are finite and bounded, queues stay within their limits, and all that is
// said is JSON or a frame of the protocol.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string_view>

#include <nlohmann/json.hpp>

#include "waymark/server/live_hub.hpp"

namespace {

using namespace waymark;

void require(bool holds) {
  if (!holds) std::abort();
}

void check_orders(LiveFeed& feed) {
  for (const ViewerOrder& order : feed.take_orders()) {
    require(std::isfinite(order.command.speed_m_s) && std::abs(order.command.speed_m_s) <= 10);
    require(std::isfinite(order.command.yaw_rate_rad_s) && std::abs(order.command.yaw_rate_rad_s) <= 20);
  }
}

void check_outbox(LiveHub& hub, LiveHub::Id id) {
  std::size_t frames = 0;
  while (const auto frame = hub.next(id)) {
    ++frames;
    if (frame->text)
      require(nlohmann::json::accept(frame->head));
    else
      require(frame->head.size() == 13 && frame->head[0] == '\x01');
  }
  require(frames <= Outbox::kMaxFrames + 1);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  LiveFeed feed;
  LiveHub hub(feed, "fuzz");
  Duration now = std::chrono::seconds(1);
  const std::optional<LiveHub::Id> viewers[] = {hub.join(kPageProtocol, true, now),
                                                hub.join("foxglove.sdk.v1", true, now),
                                                hub.join(kPageProtocol, false, now)};
  std::string_view all(reinterpret_cast<const char*>(data), size);
  for (std::size_t turn = 0; !all.empty(); ++turn) {
    const std::size_t end = all.find('\n');
    const std::string_view line = all.substr(0, end);
    all.remove_prefix(end == std::string_view::npos ? all.size() : end + 1);
    const LiveHub::Id id = *viewers[turn % 3];
    const auto held_before = hub.holder();
    if (line.starts_with('!'))
      hub.receive_binary(id, {reinterpret_cast<const std::uint8_t*>(line.data()) + 1, line.size() - 1}, now);
    else
      hub.receive_text(id, line, now);
    if (turn % 3 == 2) require(hub.holder() == held_before && hub.holder() != id);
    check_orders(feed);
    if (turn % 7 == 0) feed.publish(Sample(Odometry{.stamp = SensorTime(now)}), now.count());
    now += std::chrono::milliseconds(50);
    hub.tick(now);
  }
  for (const auto& id : viewers) check_outbox(hub, *id);
  return 0;
}
